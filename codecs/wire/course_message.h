// A course of an object on the bulk lane: what it does from a scene time on. PROTOCOL.md has the table.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "haptic_core/motion/moving_objects.h"

namespace farfeel::codecs {

inline constexpr std::size_t kCourseBytes = 137;
inline constexpr double kLatestCourse_s = 1e9;  ///< of scene time, where a course begins

/// The payload's size, or 0 if it does not fit.
[[nodiscard]] std::size_t write(const motion::ObjectCourse&, std::span<std::byte> to) noexcept;
/// Usable, with a version of 1 at least; of any object number.
[[nodiscard]] std::optional<motion::ObjectCourse> read_course(std::span<const std::byte> payload) noexcept;

}  // namespace farfeel::codecs
