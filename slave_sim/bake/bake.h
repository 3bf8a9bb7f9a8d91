// From anybody's closed triangle mesh to an asset: coarse mesh, convex surface pieces, planar charts, displacement
// texture, mass properties, and a report of how far what is felt is from what was given.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/asset/asset.h"
#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

inline constexpr std::uint32_t kTextureAuto = 0;

struct BakeOptions {
  std::uint32_t coarse_triangles = 700;  ///< aim, exceeded where material is thin (coarse_mesh.h); >= 4
  /// Side of a square whose texel count is the budget over all charts; kTextureAuto: what keeps the surface's spectrum.
  std::uint32_t texture = 1024;
  double piece_tolerance_m = -1;  ///< how far a piece may stand out of its own convexity; < 0: chosen from the mesh
  /// Heights are stored in steps of so much, and all else that is felt in few bytes too (few_bytes.h); 0: as exactly
  /// as 16 bits, floats and doubles do.
  double height_step_m = 0;
  double density_kg_per_m3 = 1200;
  contact::Material material = {};
  std::optional<geometry::TriangleMesh> coarse =
      std::nullopt;  ///< use this instead of simplifying, in the mesh's frame
  /// Simplify this in place of the mesh, in its frame: as near to it as not to matter, with fewer triangles.
  std::optional<geometry::TriangleMesh> to_simplify = std::nullopt;
  /// Triangles of what was given that are not in the mesh (repair.h), in its frame: they count as far from what is
  /// felt.
  geometry::TriangleMesh left_out = {};
};

/// Distances between the full mesh and the displaced surface, measured both ways at many points; by area.
struct Deviation {
  double rms_m = 0, max_m = 0;
  double p99_m = 0, p999_m = 0;  ///< all but a hundredth, a thousandth, are within this
  glm::dvec3 p_max_M{0};         ///< where it is greatest, in the mesh's own frame
};

/// Distances between tips of unit normals: angles in radians as long as they are small.
struct SlopeDeviation {
  double rms = 0, max = 0;
};

struct StageTime {
  std::string stage;
  double seconds;
};

struct BakeReport {
  std::uint32_t full_triangles = 0, coarse_triangles = 0, pieces = 0, charts = 0, tiles = 0;
  std::uint32_t near_pairs_p95 = 0;  ///< what it costs the haptic loop (near_pairs.h)
  std::uint32_t beyond_budget = 0;   ///< coarse triangles more than asked for, for thin material's sides and edges
  codecs::HullBreaches breaches;     ///< of the pieces' hulls, at random points of them
  double texel_m = 0;
  double reach_m = 0;               ///< how far the texture is looked for from the coarse triangles, at most
  std::uint64_t texels = 0;         ///< inside the charts' own triangles
  std::uint64_t missed_texels = 0;  ///< of those, where no ray found the full mesh: extrapolated
  Deviation full_to_felt, felt_to_full;
  double thickness_m = 0;             ///< of the full mesh, from its points straight inwards: the median
  SlopeDeviation felt_slope;          ///< of the displaced surface against the full mesh
  std::uint32_t texture = 0;          ///< as asked for, or as chosen
  double relief_rms_m = 0;            ///< of the full surface about its smooth shape
  double lost_share = 0;              ///< of the relief's variance, finer than two texels: left out, not aliased
  std::uint32_t keeping_texture = 0;  ///< the texture that would lose less than a thousandth of it
  Deviation seam_step;                ///< of the height, across chart borders on edges where the surface is smooth
  SlopeDeviation seam_slope;          ///< of the slope, there
  glm::dvec3 p_MO_M{0};               ///< where the asset's origin (the centre of mass) was in the mesh's own frame
  std::vector<StageTime> stages;
};

/// For a person, where what is felt is another shape: farther from the mesh, rms either way, than kMostDeviation of its
/// thickness.
[[nodiscard]] std::optional<std::string> words_about_deviation(const BakeReport&);
inline constexpr double kMostDeviation = 0.02;

struct Baked {
  codecs::Asset asset;
  BakeReport report;
};
struct BakeError {
  std::string message;
};
/// Told the stage's name and how much of the whole is done, in [0, 1].
using Progress = std::function<void(const std::string& stage, double done)>;

/// Precondition: closed, oriented, finite, not empty; fails with a message otherwise.
[[nodiscard]] tl::expected<Baked, BakeError> bake_asset(std::string name, const geometry::TriangleMesh& full,
                                                        const BakeOptions&, const Progress& = {});

}  // namespace farfeel::slave_sim
