// What the remote said of a contact before, where it still holds.
//
// A depth is the greatest overlap of any of the tool's points, so each of its linearisations bounds it from below, and
// all of them together with their maximum: J. E. Kelley's cutting planes, 1960. A line or a face that lies on another
// pushes at one end or at the other; the remote tells of one at a time, a round trip late, and a model of that one
// alone has nothing to tilt against: the tool rocks from end to end for ever. So it is with the two flanks of a groove
// at one end: with the one alone that was told last, a nut goes over its bolt's thread.
#pragma once

#include <array>
#include <cstddef>

#include "haptic_core/local_model/constants.h"
#include "haptic_core/local_model/tangent.h"

namespace farfeel::local_model {

/// Beside the newest tangent, which alone is asked wherever none is kept. Realtime-safe; one thread.
class KeptTangents {
 public:
  [[nodiscard]] bool is_empty() const noexcept { return count_ == 0; }

  /// Adds what was the newest before. The result is for `now`, the tangent that follows it: at its pose it says what
  /// `now` says, and nothing that is kept says more. is_late: answers are old, and the tool would be through
  /// a groove's other flank before one tells of it; that flank is felt, too.
  void keep(const Tangent& before, const Tangent& now, bool is_late) noexcept;
  /// The soft maximum of what the newest says there and of all that are kept.
  void join(Tangent::At& newest, const spatial::Pose& X_WT) const noexcept;
  /// The second derivative which that maximum has there, in the gradient's coordinates. Positive semidefinite.
  [[nodiscard]] spatial::Matrix6 bend_at(const Tangent::At& newest, const spatial::Pose& X_WT) const noexcept;
  void go_along(const spatial::Pose& way_W) noexcept;

 private:
  struct Weights;
  [[nodiscard]] Weights weights(const Tangent::At& newest, const spatial::Pose& X_WT) const noexcept;
  void add(const Tangent&) noexcept;

  std::array<Tangent, kMostKept> all_{};
  std::array<bool, kMostKept> speaks_{};  // false where the newest is so near that it alone says what is there
  std::size_t count_ = 0;
  double excess_m_ = 0;  // of the soft maximum over the newest at its own pose
};

}  // namespace farfeel::local_model
