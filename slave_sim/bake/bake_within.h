// A bake that meets a stated error at few triangles and texels, within what the haptic loop carries.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "slave_sim/bake/bake.h"
#include "slave_sim/bake/near_pairs.h"

namespace farfeel::slave_sim {

struct BakedWithin {
  Baked baked;
  std::string verdict;  ///< what was asked and found, which bound ruled, and what the other would have cost
  bool is_met = false;  ///< the error that was asked for
};

/// Of heights, in the error that is asked for: rounding adds a 1500th part to it, and slopes no grain that is felt.
inline constexpr double kHeightSteps = 8;

inline constexpr int kMostTrials = 12;               ///< bakes, each of the whole mesh
inline constexpr std::uint32_t kMostTexture = 4096;  ///< that is tried

/// What is asked for unasked: so small a share of the part's diagonal that hands don't tell, and 60 um of 200 mm.
inline constexpr double kErrorShare = 3e-4;
[[nodiscard]] double error_unasked_m(const geometry::TriangleMesh&);

/// Tries numbers of triangles and textures, up to most_texture; those in the options are not looked at. Of what it
/// tried it takes the fewest triangles whose deviation is at most six tenths of rms_m either way, then the smallest
/// texture; it tries until that many are within a third of what is too few. Then it takes the mesh of fewest triangles
/// from which heights follow within rms_m (detail.h), if that is fewer bytes than the heights. Where such a surface has
/// more than most_near_pairs (near_pairs.h) the loop's bound rules, and it takes what deviates least within that, or
/// has fewest. By counted work: the same mesh, options and error give the same bytes. Precondition: rms_m > 0.
[[nodiscard]] tl::expected<BakedWithin, BakeError> bake_within(const std::string& name,
                                                               const geometry::TriangleMesh& full, BakeOptions options,
                                                               double rms_m, const Progress& = {},
                                                               std::uint32_t most_near_pairs = kMostNearPairs,
                                                               std::uint32_t most_texture = kMostTexture);

}  // namespace farfeel::slave_sim
