// What the haptic lane's messages may say at most, and what can be wrong with one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "haptic_core/contact/curvature.h"

namespace farfeel::codecs {

// Specification constants. Values outside are refused by the readers.
inline constexpr std::uint32_t kMostAhead_us = 10'000;
inline constexpr double kMaxCoordinate_m = 1e4;
inline constexpr double kMaxSpeed = 1e4;      ///< [m/s], [rad/s]
inline constexpr double kMaxForce = 1e6;      ///< [N], [N m]
inline constexpr double kMaxGradient = 1e4;   ///< [1], [m/rad]
inline constexpr double kMaxLineValue = 1e6;  ///< [m/s], [rad/s], [N], [N m], [W^0.5]
inline constexpr double kMaxCurvature = 1e8;  ///< [1/m], [m/rad^2], [1/rad]
inline constexpr double kMaxStiffness_N_per_m = 1e8;
inline constexpr double kMaxDamping_Ns_per_m = 1e6;
inline constexpr double kMaxFriction = 100;

enum class Fault : std::uint8_t {
  kNone,
  kLength,
  kNotFinite,
  kRange,
  kOld,    ///< as old as what was read before, or older
  kNoBase  ///< it refers to what is not known here
};
[[nodiscard]] std::string_view to_string(Fault) noexcept;

/// Bits of a contact's doubts that may be set. Bit 0 is none; bit 7 was set where a remote handed contacts over, and no
/// remote sets it any more.
inline constexpr unsigned kWireDoubts = 0xFE;

}  // namespace farfeel::codecs
