// Where the jumps of a contact frame's force come from, from one frame to the next.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "haptic_core/contact/contact_set.h"

namespace farfeel::bench {

/// What happened to the contact whose force changed most.
enum class JumpCause {
  kComesOrGoes,    ///< no contact of the other frame stands in its place, whatever its id
  kTurns,          ///< its direction turned: its cluster's did
  kPeakElsewhere,  ///< the depth is decided in another place: two peaks about as high
  kSamePeak,       ///< none of these: steep texture under a fast tool, or the depth's own fault
};
inline constexpr std::array<std::string_view, 4> kJumpCauses{"comes_or_goes", "turns", "peak_elsewhere", "same_peak"};

/// The greatest change of any contact's force, by cause [N]. Friction and damping are left out.
class ForceJumps {
 public:
  void add(const contact::ContactSet&);
  void restart() { has_last_ = false; }
  [[nodiscard]] double greatest_N(JumpCause cause) const { return greatest_N_[static_cast<std::size_t>(cause)]; }
  /// The same a millimetre of the tool's way, over at least 0.01 mm: what steepness explains.
  [[nodiscard]] double greatest_N_per_mm(JumpCause cause) const {
    return greatest_N_per_mm_[static_cast<std::size_t>(cause)];
  }

 private:
  std::vector<contact::Contact> last_;
  spatial::Pose last_X_WT_;
  bool has_last_ = false;
  std::array<double, kJumpCauses.size()> greatest_N_{}, greatest_N_per_mm_{};
};

}  // namespace farfeel::bench
