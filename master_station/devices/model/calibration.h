// What one device needs so that its readings and forces are those of its base frame B. A is the frame in which its
// driver tells them.
#pragma once

#include "master_station/devices/link/sample.h"

namespace farfeel::devices {

struct Calibration {
  glm::dmat3 R_BA{1};         ///< each axis of A is one of B, or its opposite; right-handed
  glm::dvec3 offset_B_m{0};   ///< added to positions: of A's origin in B
  double units_per_N = 1;     ///< of the driver's force; other than 1: of a device that tells no newtons itself
  glm::dvec3 gravity_B_N{0};  ///< the force that holds the handle up where nobody does
  Deflection neutral;         ///< of a rate input that nobody touches, in A
  [[nodiscard]] bool operator==(const Calibration&) const;
};

/// The sample with pose, twist and deflection in B. A deflection's length is at most 1 along each axis, and what is
/// beyond neutral counts in full. Realtime-safe.
[[nodiscard]] Sample calibrated(const Calibration&, const Sample& in_A) noexcept;
/// A wrench for the device, which takes it in A. Realtime-safe.
[[nodiscard]] spatial::Wrench for_device(const Calibration&, const spatial::Wrench& F_B) noexcept;

}  // namespace farfeel::devices
