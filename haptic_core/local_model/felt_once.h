// Where the remote tells of a contact late and this end finds it at once: which of the two is felt, so that nothing
// pushes twice.
//
// A contact that is found between outlines is off by no more than a bound b: the true depth lies in [d - b, d + b].
// What the remote tells of the place is truer, but linearised where the tool was a round trip ago. So it is felt as
// long as it lies within the bound; else the found one is, as deep as the nearer end of the bound. Where it has told
// nothing, d is felt. As told and found go out of each other's bound the felt depth goes on without a jump.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::local_model {

/// At the tool's pose.
struct PlacedContact {
  std::uint32_t object = 0;
  glm::dvec3 nhat_W{0}, p_T{0};
  double depth_m = 0;
  double off_m = 0;  ///< b; of a found one
};
[[nodiscard]] PlacedContact placed(const contact::Contact& here, const spatial::Pose& X_WT, double off_m = 0) noexcept;
[[nodiscard]] bool looks_like(const PlacedContact&, const PlacedContact&) noexcept;

/// The depth of the two that is felt, as above; which it is, by `told.depth_m ==`.
[[nodiscard]] double depth_within_m(const PlacedContact& found, double told_depth_m) noexcept;

struct FeltOnce {
  std::array<bool, contact::kMaxContacts> told{}, found{};  ///< which are felt
  std::array<double, contact::kMaxContacts> found_depth_m{};
};
/// Where nothing found is as told, as in rungs that feel the remote's contacts. At most kMaxContacts of each. A told
/// one that is near no found one is felt, and speaks of any found one that looks the same way and has no other: where
/// coarse faces lie flat on each other the point of a contact may be any of theirs, however far.
[[nodiscard]] FeltOnce felt_once(std::span<const PlacedContact> found, std::span<const PlacedContact> told) noexcept;

}  // namespace farfeel::local_model
