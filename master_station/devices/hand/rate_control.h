// From how far a rate input is deflected to how fast the tool goes.
//
// With d the deflection, -1 to 1, |d| its length, d0 the dead band:
//   x = (|d| - d0) / (1 - d0), within 0 and 1
//   v = full_speed x^2 d / |d|
// for pushes and for turns, each as a vector, so that a slanting push stays slanting. The square makes slow motions
// precise: a quarter of the way is a sixteenth of the speed. The speed rises and falls by its full range in kRise_s.
#pragma once

#include <cstdint>

#include "master_station/devices/link/sample.h"

namespace farfeel::devices {

enum class Axes : std::uint8_t {
  kAll,          ///< pushes move, turns turn
  kTranslation,  ///< pushes move; turns do nothing
  kRotation,     ///< turns turn; pushes do nothing
  kDominant      ///< only the one axis of the six that is deflected most
};

struct RateSettings {
  Axes axes = Axes::kAll;
  double full_speed_m_s = 0.1, full_rotation_rad_s = 1;  ///< at full deflection
};

/// The share of full speed, 0 to 1, at a deflection of that length. What is not a number is 0.
[[nodiscard]] double shaped(double deflection) noexcept;

/// Of the rate, what is left after so long a silence: all of it for kHalfStale_ns, then less in proportion, nothing
/// from kStaleSample_ns on. The rate of a device that is gone ends without a step.
[[nodiscard]] double trusted_share(std::int64_t silence_ns) noexcept;

/// Realtime-safe.
class RateControl {
 public:
  explicit RateControl(const RateSettings& settings) noexcept : settings_(settings) {}

  /// The rate, dt_s after the last call, in the axes of the device's base. trusted: share of it that counts; at 0 the
  /// rate is zero at once, and rises anew. A deflection that is not finite counts as none.
  [[nodiscard]] spatial::Twist advance(const Deflection&, double trusted, double dt_s) noexcept;

  /// A hand at rest on the cap, and a zero that has drifted, are well below it.
  static constexpr double kDeadBand = 0.05;
  /// Shorter than a person notices; it takes the steps of reports at 60 to 125 Hz off the speed.
  static constexpr double kRise_s = 0.02;
  /// Another axis takes over when it is deflected by so much more: two that are nearly equal do not take turns.
  static constexpr double kTakesOver = 1.25;

 private:
  [[nodiscard]] Deflection chosen(const Deflection&) noexcept;

  RateSettings settings_;
  Deflection share_;  // of full speed, as it rises and falls
  int dominant_ = 0;  // 0-2 turn, 3-5 push
};

}  // namespace farfeel::devices
