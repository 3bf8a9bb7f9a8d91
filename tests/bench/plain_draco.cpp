#include "tests/bench/plain_draco.h"

#include <algorithm>
#include <cmath>

#include "codecs/mesh/draco_mesh.h"
#include "slave_sim/bake/edge_collapse.h"
#include "slave_sim/bake/full_surface.h"
#include "slave_sim/bake/surface_points.h"

namespace farfeel::bench {
namespace {

using geometry::TriangleMesh;

double one_way_rms_m(const TriangleMesh& from, const slave_sim::FullSurface& to) {
  constexpr int kSamples = 20'000;
  slave_sim::SurfacePoints points(from, 1);
  double squares = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double distance_m = to.distance_m(points.next().p_O);
    squares += distance_m * distance_m;
  }
  return std::sqrt(squares / kSamples);
}

double two_way_rms_m(const TriangleMesh& full, const slave_sim::FullSurface& full_surface, const TriangleMesh& mesh) {
  const slave_sim::FullSurface surface(mesh);
  return std::max(one_way_rms_m(full, surface), one_way_rms_m(mesh, full_surface));
}

}  // namespace

PlainDraco plain_draco(const TriangleMesh& full, double rms_m) {
  constexpr double kOfSquare = 2.0 / 3;
  constexpr int kHalvings = 6, kLeastBits = 7, kMostBits = 18;
  const slave_sim::FullSurface surface(full);
  double few = 8, enough = static_cast<double>(full.triangles.size());
  TriangleMesh simplified = full;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(few * enough);
    TriangleMesh tried = slave_sim::edge_collapsed(full, static_cast<std::uint32_t>(middle));
    if (!tried.triangles.empty() && two_way_rms_m(full, surface, tried) <= std::sqrt(kOfSquare) * rms_m) {
      enough = middle, simplified = std::move(tried);
    } else {
      few = middle;
    }
  }
  for (int bits = kLeastBits; bits <= kMostBits; ++bits) {
    const auto bitstream = codecs::write_draco(simplified, bits);
    if (!bitstream) return {};
    const auto decoded = codecs::read_draco(*bitstream, static_cast<std::uint32_t>(simplified.triangles.size()));
    if (!decoded) continue;  // on so coarse a grid nothing is left
    if (const double found_m = two_way_rms_m(full, surface, *decoded); found_m <= rms_m)
      return {bitstream->size(), simplified.triangles.size(), bits, found_m};
  }
  return {};
}

}  // namespace farfeel::bench
