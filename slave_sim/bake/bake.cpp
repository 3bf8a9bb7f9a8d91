#include "slave_sim/bake/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "codecs/asset/felt_stream.h"
#include "haptic_core/geometry/piece_thickness.h"
#include "slave_sim/bake/chart_layout.h"
#include "slave_sim/bake/coarse_mesh.h"
#include "slave_sim/bake/convex_pieces.h"
#include "slave_sim/bake/deviation.h"
#include "slave_sim/bake/displacement.h"
#include "slave_sim/bake/drawn_mesh.h"
#include "slave_sim/bake/few_bytes.h"
#include "slave_sim/bake/full_surface.h"
#include "slave_sim/bake/mass.h"
#include "slave_sim/bake/near_pairs.h"
#include "slave_sim/bake/spectrum.h"

namespace farfeel::slave_sim {
namespace {

using geometry::TriangleMesh;

constexpr std::uint32_t kVisibleTriangles = 30'000;  // drawn smoothly enough, about 60 kB under Draco
constexpr std::uint32_t kThicknessSamples = 4'000;
constexpr double kOwnSide_m = 5e-5;  // codecs::HullBreaches says so too

/// Times stages and tells the listener about them.
class Stages {
 public:
  Stages(BakeReport& report, const Progress& progress) : report_(report), progress_(progress) {}

  void begin(std::string stage, double done) {
    close();
    stage_ = std::move(stage);
    if (progress_) progress_(stage_, done);
    started_ = std::chrono::steady_clock::now();
  }

  void close() {
    if (stage_.empty()) return;
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - started_;
    report_.stages.push_back({std::move(stage_), taken.count()});
  }

 private:
  BakeReport& report_;
  const Progress& progress_;
  std::string stage_;
  std::chrono::steady_clock::time_point started_;
};

std::string refusal(const TriangleMesh& full, const BakeOptions& options) {
  if (full.triangles.empty()) return "the mesh has no triangles";
  for (const geometry::Triangle& t : full.triangles) {
    if (std::max({t[0], t[1], t[2]}) >= full.positions_O.size()) return "a triangle names a vertex that does not exist";
  }
  if (!std::all_of(full.positions_O.begin(), full.positions_O.end(),
                   [](const auto& p) { return spatial::is_finite(p); })) {
    return "a coordinate is not a finite number";
  }
  if (!geometry::is_closed_and_oriented(full))
    return "the mesh is not closed and consistently oriented; close it first";
  if (!(mass_properties(full, 1).mass_kg > 0)) return "the mesh encloses no volume or faces inwards";
  if (options.coarse && !geometry::is_closed_and_oriented(*options.coarse))
    return "the given coarse mesh is not closed";
  if (options.coarse_triangles < 4) return "a closed mesh needs at least 4 coarse triangles";
  if (options.texture != kTextureAuto && (options.texture < 16 || options.texture > 16384))
    return fmt::format("texture {} is not in 16..16384", options.texture);
  if (!(options.density_kg_per_m3 > 0)) return "the density must be positive";
  return {};
}

TriangleMesh moved(TriangleMesh mesh, const glm::dvec3& by) {
  for (glm::dvec3& p : mesh.positions_O) p += by;
  return mesh;
}

TriangleMesh rounded(TriangleMesh mesh) {
  constexpr double kZero_m = 1e-15;  // less is rounding noise about a plane of symmetry
  for (glm::dvec3& p : mesh.positions_O) {
    p = geometry::rounded_to_float(p);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(p[axis]) < kZero_m) p[axis] = 0;
    }
  }
  return mesh;
}

/// How far from a chart's triangles its texture may lie: half as much again as the worst distance seen from them to the
/// full mesh, and a little of the object's size. What a ray meets beyond is another part of the surface.
double reach_m(const TriangleMesh& coarse, const ChartPlan& chart, const FullSurface& full, double size_m) {
  constexpr int kSamples = 6;  // along a triangle's side
  double worst_m = 0;
  for (const std::uint32_t i : chart.triangles) {
    const geometry::Triangle& t = coarse.triangles[i];
    const glm::dvec3 &a = coarse.positions_O[t[0]], &b = coarse.positions_O[t[1]], &c = coarse.positions_O[t[2]];
    for (int u = 0; u <= kSamples; ++u) {
      for (int v = 0; u + v <= kSamples; ++v) {
        const glm::dvec3 p =
            a + (static_cast<double>(u) * (b - a) + static_cast<double>(v) * (c - a)) / double{kSamples};
        worst_m = std::max(worst_m, full.distance_m(p));
      }
    }
  }
  return 1.5 * worst_m + 0.002 * size_m;
}

double mean_edge_m(const TriangleMesh& mesh) {
  double sum_m = 0;
  for (const geometry::Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) sum_m += glm::length(mesh.positions_O[t[k]] - mesh.positions_O[t[(k + 1) % 3]]);
  }
  return sum_m / (3 * static_cast<double>(mesh.triangles.size()));
}

/// edge_m: the full mesh's; texels that are larger get as many rays as would resolve it, up to a limit. reach_m: set to
/// that of the chart with the largest.
std::vector<BakedChart> baked_charts(const TriangleMesh& coarse, const ChartLayout& layout, const FullSurface& full,
                                     double edge_m, double& most_reach_m) {
  constexpr double kMostAcross = 4;
  const int rays_across = static_cast<int>(std::clamp(std::ceil(layout.texel_m / edge_m), 1.0, kMostAcross));
  const double size_m = glm::length(geometry::bounding_box(coarse).size());
  std::vector<BakedChart> baked(layout.charts.size());
  std::vector<double> reaches_m(layout.charts.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < baked.size(); i = next++) {
      reaches_m[i] = reach_m(coarse, layout.charts[i], full, size_m);
      baked[i] = baked_chart(coarse, layout.charts[i], layout.texel_m, full, reaches_m[i], rays_across);
    }
  };
  std::vector<std::jthread> others;
  for (unsigned i = 1; i < std::max(1U, std::thread::hardware_concurrency()); ++i) others.emplace_back(work);
  work();
  others.clear();  // joins
  most_reach_m = *std::max_element(reaches_m.begin(), reaches_m.end());
  return baked;
}

}  // namespace

std::optional<std::string> words_about_deviation(const BakeReport& report) {
  const Deviation &to = report.full_to_felt, &back = report.felt_to_full;
  const double rms_m = std::max(to.rms_m, back.rms_m);
  if (!(rms_m > kMostDeviation * report.thickness_m)) return std::nullopt;
  const Deviation& worse = to.max_m > back.max_m ? to : back;
  return fmt::format(
      "what is felt is another shape than the mesh: {:.0f} um rms from it, more than {:.0f} % of its median thickness "
      "of "
      "{:.3g} mm, and {:.3g} mm at ({:.6g}, {:.6g}, {:.6g}) m; more --triangles or --texture bring it nearer, and so "
      "does "
      "a mesh with less to mend",
      1e6 * rms_m, 100 * kMostDeviation, 1e3 * report.thickness_m, 1e3 * worse.max_m, worse.p_max_M.x, worse.p_max_M.y,
      worse.p_max_M.z);
}

tl::expected<Baked, BakeError> bake_asset(std::string name, const TriangleMesh& full_M, const BakeOptions& options,
                                          const Progress& progress) {
  if (const std::string why = refusal(full_M, options); !why.empty()) {
    return tl::unexpected(BakeError{fmt::format("cannot bake {}: {}", name, why)});
  }
  Baked out;
  codecs::Asset& asset = out.asset;
  BakeReport& report = out.report;
  Stages stages(report, progress);

  stages.begin("mass", 0);
  const MassProperties mass = mass_properties(full_M, options.density_kg_per_m3);
  const TriangleMesh full = moved(full_M, -mass.p_OCom_O);
  const TriangleMesh fewer = moved(options.to_simplify.value_or(TriangleMesh{}), -mass.p_OCom_O);
  asset.name = std::move(name);
  asset.material = options.material;
  asset.mass_kg = mass.mass_kg;
  asset.inertia_O_kg_m2 = mass.inertia_Com_kg_m2;
  asset.p_OM_O = -mass.p_OCom_O;
  report.p_MO_M = mass.p_OCom_O;

  stages.begin("simplify", 0.05);
  const TriangleMesh& shape = options.to_simplify ? fewer : full;
  asset.visible = simplified_for_drawing(shape, kVisibleTriangles);
  geometry::HapticSurface& felt = asset.felt;
  if (options.coarse) {
    felt.coarse = rounded(moved(*options.coarse, -mass.p_OCom_O));
  } else {
    felt.coarse = rounded(coarse_mesh(shape, options.coarse_triangles));
    if (felt.coarse.triangles.empty()) {
      return tl::unexpected(
          BakeError{fmt::format("cannot bake {}: it touches itself in a vertex; split that in two first", asset.name)});
    }
    if (!geometry::is_closed_and_oriented(felt.coarse)) {
      return tl::unexpected(BakeError{fmt::format("cannot bake {}: simplifying it left no closed mesh", asset.name)});
    }
  }

  const bool takes_few_bytes = options.height_step_m > 0;
  if (takes_few_bytes) felt.coarse = on_grid(felt.coarse);

  stages.begin("pieces", 0.25);
  const double size_m = glm::length(geometry::bounding_box(felt.coarse).size());
  // Well below any relief that is felt; tighter, what is left of the relief on the coarse mesh divides flat faces.
  const double tolerance_m = options.piece_tolerance_m >= 0 ? options.piece_tolerance_m : 4e-4 * size_m;
  const ConvexPieces pieces = convex_pieces(felt.coarse, {.tolerance_m = tolerance_m, .own_side_m = kOwnSide_m});
  felt.triangle_piece = pieces.triangle_piece;
  felt.piece_count = pieces.count;
  felt.piece_thickness_m = geometry::measured_thickness_m(felt);
  if (takes_few_bytes) round_thickness(felt.piece_thickness_m);
  asset.breaches = hull_breaches(felt.coarse, pieces, kOwnSide_m);

  const FullSurface surface(full);
  const double edge_m = mean_edge_m(full);
  report.texture = options.texture == kTextureAuto ? 1024 : options.texture;
  ChartLayout layout;
  std::vector<BakedChart> baked;
  const auto bake_charts = [&] {
    stages.begin("charts", 0.3);
    layout = chart_layout(felt.coarse, felt.triangle_piece, report.texture);
    if (takes_few_bytes) put_frames_on_grid(layout);
    stages.begin("rays", 0.35);
    baked = baked_charts(felt.coarse, layout, surface, edge_m, report.reach_m);
    stages.begin("spectrum", 0.7);
    const Fineness fine = fineness(layout, baked, surface, edge_m, size_m);
    report.relief_rms_m = fine.rms_m;
    report.lost_share = fine.lost_share;
    report.keeping_texture =
        static_cast<std::uint32_t>(std::ceil(report.texture * layout.texel_m / fine.keeping_texel_m));
  };
  bake_charts();
  if (options.texture == kTextureAuto) {
    report.texture = std::clamp(report.keeping_texture, 256U, 4096U);
    bake_charts();
  }
  felt.triangle_chart = layout.triangle_chart;
  std::vector<geometry::SampledChart> sampled;
  for (const BakedChart& chart : baked) sampled.push_back(chart.heights);
  geometry::set_height_fields(felt, sampled);
  if (takes_few_bytes) round_heights(felt, baked, options.height_step_m);

  stages.begin("deviation", 0.75);
  const TriangleMesh left_out = moved(options.left_out, -mass.p_OCom_O);
  tell_deviation({full, left_out, surface}, felt, baked, report);
  report.thickness_m = median_thickness_m(full, surface, kThicknessSamples);
  report.near_pairs_p95 = near_pairs_p95(felt);
  if (takes_few_bytes) felt = codecs::stored_order(felt);
  stages.close();

  report.full_triangles = static_cast<std::uint32_t>(full.triangles.size());
  report.coarse_triangles = static_cast<std::uint32_t>(felt.coarse.triangles.size());
  if (!options.coarse && report.coarse_triangles > options.coarse_triangles)
    report.beyond_budget = report.coarse_triangles - options.coarse_triangles;
  report.pieces = felt.piece_count;
  report.breaches = asset.breaches;
  report.charts = static_cast<std::uint32_t>(felt.charts.size());
  report.tiles = static_cast<std::uint32_t>(felt.tiles.size());
  report.texel_m = layout.texel_m;
  return out;
}

}  // namespace farfeel::slave_sim
