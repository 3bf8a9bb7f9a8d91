// The models and tools of `farfeel-bench touch`, baked by the product and kept in the asset cache.
#pragma once

#include <string>
#include <vector>

#include "codecs/asset/asset.h"
#include "haptic_core/penetration/felt_surface.h"
#include "tests/bench/touch_models.h"
#include "tests/bench/touch_truth.h"

namespace farfeel::bench {

/// An asset and the mesh that it was baked from.
struct BakedMesh {
  codecs::Asset asset;
  geometry::TriangleMesh original_O;                ///< in the asset's frame
  double p999_m = 0;                                ///< the worse of full to felt and felt to full
  std::uint32_t coarse_triangles = 0, texture = 0;  ///< as asked for
};

/// Baked with the options, and finer while its p99.9 is above kMostDeviation_m, at most kFinerBakes times; from the
/// cache where it is there. is_anew: baked whether or not it is.
inline constexpr double kMostDeviation_m = 0.3e-3;
inline constexpr int kFinerBakes = 3;
[[nodiscard]] tl::expected<BakedMesh, std::string> kept_asset(const std::string& name, const TouchMesh&, bool is_anew);

/// Ready to be touched by many threads. Keeps its place.
struct TouchSubject {
  explicit TouchSubject(BakedMesh&&);
  TouchSubject(const TouchSubject&) = delete;
  TouchSubject& operator=(const TouchSubject&) = delete;

  BakedMesh baked;
  penetration::FeltSurface felt;
  TouchTruth truth;
  std::vector<double> area_up_to_m2;  ///< of the original's triangles, for places spread evenly over it
  /// What a depth may be off by: 0.1 mm, or as much as the asset is.
  [[nodiscard]] double allowed_m() const { return std::max(0.1e-3, baked.p999_m); }
};

struct TouchTool {
  std::string name;
  RoundTool shape;
  BakedMesh baked;
  penetration::FeltSurface felt;
  TouchTool(std::string tool_name, const RoundTool&, BakedMesh&&);
  TouchTool(const TouchTool&) = delete;
  TouchTool& operator=(const TouchTool&) = delete;
};

/// Names of all tools; balls by their diameters in millimetres.
[[nodiscard]] const std::vector<std::string>& touch_tool_names();
/// By one of those names, or "ball-" and any diameter. Throws CLI::Error with what is wrong.
[[nodiscard]] std::unique_ptr<TouchTool> touch_tool(const std::string& name, bool is_anew);

}  // namespace farfeel::bench
