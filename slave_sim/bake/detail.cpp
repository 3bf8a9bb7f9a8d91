// A mesh that was simplified runs through the surface's middle with its flat triangles; the curved surface through its
// vertices bulges beyond. So the vertices are moved, a few times, by the mean of what the curved surface is off by
// round them, along its normals. Of scans that takes a fifth fewer triangles than flat ones do.
#include "slave_sim/bake/detail.h"

#include <cmath>
#include <utility>

#include "codecs/asset/curved_mesh.h"
#include "codecs/asset/felt_stream.h"
#include "haptic_core/geometry/quartered.h"
#include "slave_sim/bake/deviation.h"
#include "slave_sim/bake/edge_collapse.h"

namespace farfeel::slave_sim {
namespace {

using codecs::CurvedMesh;
using geometry::TriangleMesh;

TriangleMesh moved(TriangleMesh mesh, const glm::dvec3& by) {
  for (glm::dvec3& p : mesh.positions_O) p += by;
  return mesh;
}

/// How far along the curved surface's normal the full one is, at most reach_m.
void fit(TriangleMesh& mesh, const FullSurface& full, double reach_m) {
  constexpr int kTimes = 5, kParts = 4;
  constexpr double kShare = 0.8;  // of the way: neighbours move too
  for (int time = 0; time < kTimes; ++time) {
    const CurvedMesh curved(mesh);
    std::vector<glm::dvec3> moves(mesh.positions_O.size(), glm::dvec3(0));
    std::vector<double> weights(mesh.positions_O.size(), 0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const geometry::Triangle& v = mesh.triangles[t];
      const glm::dvec3& a = mesh.positions_O[v[0]];
      const double area = glm::length(glm::cross(mesh.positions_O[v[1]] - a, mesh.positions_O[v[2]] - a));
      for (int i = 0; i <= kParts; ++i) {
        for (int j = 0; i + j <= kParts; ++j) {
          const glm::dvec3 w(1.0 - double{1.0} * (i + j) / kParts, double{1.0} * i / kParts, double{1.0} * j / kParts);
          const glm::dvec3 n = curved.normal(t, w);
          if (n == glm::dvec3(0)) continue;
          const double off_m = full.height_along(curved.point(t, w), n, reach_m).value_or(0);
          for (int k = 0; k < 3; ++k) {
            moves[v[static_cast<std::size_t>(k)]] += area * w[k] * off_m * n;
            weights[v[static_cast<std::size_t>(k)]] += area * w[k];
          }
        }
      }
    }
    for (std::size_t v = 0; v < moves.size(); ++v) {
      if (weights[v] > 0) mesh.positions_O[v] += kShare / weights[v] * moves[v];
    }
  }
}

}  // namespace

Details::Details(const Baked& baked, const TriangleMesh& full, const BakeOptions& options)
    : baked_(baked),
      full_(moved(full, -baked.report.p_MO_M)),
      left_out_(moved(options.left_out, -baked.report.p_MO_M)),
      to_simplify_(options.to_simplify ? moved(*options.to_simplify, -baked.report.p_MO_M) : full_),
      surface_(full_) {}

std::uint32_t Details::most_triangles() const {
  constexpr std::size_t kMostToDivide = 50'000;
  const std::size_t all = to_simplify_.triangles.size();
  return static_cast<std::uint32_t>(all > kMostToDivide ? all : 4 * all);
}

std::optional<Baked> Details::with(std::uint32_t triangles, double rms_m) const {
  constexpr double kReach = 4, kSteps = 1.5;  // of the error that is asked for; to it
  // Facets that are large for the error stay facets only where they are divided: curved, they are another shape.
  const bool is_finer = triangles > to_simplify_.triangles.size();
  TriangleMesh mesh = edge_collapsed(is_finer ? geometry::quartered(to_simplify_) : to_simplify_, triangles);
  if (mesh.triangles.empty()) return std::nullopt;
  fit(mesh, surface_, kReach * rms_m);
  const double step_m = std::exp2(std::floor(std::log2(rms_m / kSteps)));
  for (glm::dvec3& p : mesh.positions_O) p = step_m * glm::round(p / step_m) + 0.0;

  Baked out = baked_;
  out.asset.detail = {codecs::stored_order(mesh), out.report.reach_m, out.report.texel_m};
  const auto charts =
      codecs::follow(out.asset.felt, static_cast<std::uint32_t>(out.asset.felt.charts.size()), out.asset.detail);
  if (!charts || !codecs::can_be_told(out.asset.felt)) return std::nullopt;
  tell_deviation({full_, left_out_, surface_}, out.asset.felt, *charts, out.report);
  out.report.tiles = static_cast<std::uint32_t>(out.asset.felt.tiles.size());
  return out;
}

std::size_t felt_bytes(const codecs::Asset& asset) {
  return codecs::encoded_felt(asset.felt, asset.detail.mesh).size();
}

}  // namespace farfeel::slave_sim
