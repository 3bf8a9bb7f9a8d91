// Numbers in as few bytes as what they mean needs. Each decoder gives the value that stands for the code; each encoder
// the code whose value is nearest. What is not finite, or beyond a code's range, becomes a code that decodes to what is
// not finite, or has no value: a reader refuses it. Realtime-safe.
#pragma once

#include <cstdint>
#include <optional>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::codecs {

/// IEEE 754 binary16: 11 binary digits, so off by 0.049 % at most and 0.02 % in the mean; steps of 6e-8 below 6.1e-5.
/// For what is small beside something that is told more finely.
inline constexpr double kMostHalf = 65504;
[[nodiscard]] std::uint16_t half_of(double) noexcept;
[[nodiscard]] double from_half(std::uint16_t) noexcept;

/// The upper 24 bits of a single: 16 binary digits, so off by 0.0015 % at most, at any size.
[[nodiscard]] std::uint32_t float24_of(double) noexcept;
[[nodiscard]] double from_float24(std::uint32_t) noexcept;

/// A unit vector on an octahedron: u and v of n / (|nx| + |ny| + |nz|), where its lower half is folded out, in steps of
/// 1 / (2^23 - 1): off by 3e-7 rad at most. Coarser would be felt: an answer is drawn on for all of a round trip. A
/// length other than 1 is lost.
struct Direction {
  std::int32_t u = 0, v = 0;  ///< 24 bits
};
[[nodiscard]] Direction direction_of(const glm::dvec3& nhat) noexcept;
[[nodiscard]] std::optional<glm::dvec3> from_direction(Direction) noexcept;

/// A rotation: bits 0-59 the three components of its quaternion, w before x before y before z, that are left when the
/// largest is taken out, made positive; 20 bits each, the first lowest, c sqrt(2) (2^19 - 1) + 2^19; bits 60-61 which
/// one was taken out. Off by 4e-6 rad at most: 0.4 um at an arm of 0.1 m.
[[nodiscard]] std::uint64_t rotation_of(const glm::dquat&) noexcept;
[[nodiscard]] std::optional<glm::dquat> from_rotation(std::uint64_t) noexcept;

}  // namespace farfeel::codecs
