// Where poses lie on the wire: on a grid that both ends know for a session.
//
// What a contact says is true at the pose that it answers. So the slave computes at the pose as it was told, the master
// remembers what it told, and no force is off by the grid's step; a surface is only asked about a fraction of a
// micrometre beside the tool. What does not lie on the grid is told in full.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "codecs/wire/haptic_limits.h"
#include "codecs/wire/wire_fields.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::codecs {

inline constexpr std::size_t kPoseGridBytes = 25;
inline constexpr std::size_t kGridPoseBytes = 17;  ///< 9 of position, 8 of rotation
inline constexpr std::size_t kFullPoseBytes = 56;
inline constexpr int kFinestExponent = -24;    ///< 0.06 um, over 1 m
inline constexpr int kCoarsestExponent = -20;  ///< 0.95 um, over 16 m: texture is no coarser
inline constexpr std::int32_t kGridHalf = (1 << 23) - 1;

struct PoseGrid {
  glm::dvec3 middle_W{0};                  ///< [m]
  std::int8_t exponent = kFinestExponent;  ///< the step is 2^exponent m, and a coordinate within kGridHalf of them

  [[nodiscard]] double step_m() const noexcept;
  friend bool operator==(const PoseGrid&, const PoseGrid&) = default;
};

/// The finest that holds twice the box, which is where a tool may go, as far as a grid may.
[[nodiscard]] PoseGrid grid_around(const glm::dvec3& low_W, const glm::dvec3& high_W) noexcept;
/// Writes kPoseGridBytes: the middle in 3 f64, the exponent in an i8. Returns the bytes written, 0 if they do not fit.
[[nodiscard]] std::size_t write(const PoseGrid&, std::span<std::byte> to) noexcept;
[[nodiscard]] Fault read(std::span<const std::byte>, PoseGrid& out) noexcept;

/// A vector in whole steps; nothing where it is not finite or farther out than a grid reaches.
struct Steps {
  std::int32_t x = 0, y = 0, z = 0;
};
[[nodiscard]] std::optional<Steps> steps_of(const glm::dvec3&, double step_m) noexcept;
[[nodiscard]] glm::dvec3 from_steps(const Steps&, double step_m) noexcept;

/// 9 bytes: i24 x 3.
void write_steps(transport::ByteWriter&, const Steps&) noexcept;
/// -2^23 is refused.
[[nodiscard]] Steps read_steps(CheckedReader&) noexcept;

/// A position is told on the grid, or in full where it lies outside; a rotation always on its own: quantised.h.
struct ToldPose {
  std::optional<Steps> steps;  ///< none: p is told in full
  glm::dvec3 p{0};
  std::uint64_t rotation = 0;
};
[[nodiscard]] ToldPose told(const spatial::Pose&, const PoseGrid&) noexcept;
/// The pose as both ends then have it; what was not finite stays so.
[[nodiscard]] spatial::Pose from_told(const ToldPose&, const PoseGrid&) noexcept;
/// kGridPoseBytes, or 32 where the position is in full.
void write_told(transport::ByteWriter&, const ToldPose&) noexcept;
[[nodiscard]] spatial::Pose read_told(CheckedReader&, bool is_in_full, const PoseGrid&) noexcept;

/// from_told(told(X)): what a remote that computes where it was not asked should compute at.
[[nodiscard]] inline spatial::Pose on_grid(const spatial::Pose& X, const PoseGrid& grid) noexcept {
  return from_told(told(X, grid), grid);
}

}  // namespace farfeel::codecs
