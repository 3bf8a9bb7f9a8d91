// Where the Falcon's grip is, from its encoders, and what its motors have to do for a force on the grip.
//
// A delta mechanism with three arms at 105, -15 and -135 degrees about z. Frame F: x to the right, y up, z towards the
// person, origin in the middle of the base. An arm's angle grows as the grip comes out towards the person. Geometry and
// names after R. E. Stamper, "A Three Degree of Freedom Parallel Manipulator with Only Translational Degrees of
// Freedom", PhD thesis 97-4, University of Maryland, 1997, with libnifalcon's lengths; compare S. Martin and N.
// Hillier, "Characterisation of the Novint Falcon Haptic Device for Application as a Robot Manipulator", ACRA 2009.
// Every function is finite or says no, for any numbers in, NaN too; none allocates.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

namespace farfeel::codecs {

using FalconAngles = std::array<double, 3>;  ///< of the arms at the top, right and left [rad]

/// theta = 35 degrees + count / (4 x 320) x 360 degrees x 14.25 mm / 110 mm: the drum's angle of 0.036435 degrees a
/// count.
[[nodiscard]] FalconAngles falcon_angles_of_counts(const std::array<std::int16_t, 3>& counts) noexcept;

/// Inverse kinematics in closed form; nothing where an arm cannot reach p_F [m].
[[nodiscard]] std::optional<FalconAngles> falcon_angles(const glm::dvec3& p_F) noexcept;

/// Forward kinematics. The shins end in two joints with an offset, so the grip lies on three tori, not spheres: it
/// starts where spheres of the same reach meet, goes on by Newton's method, at most 10 steps, and is checked by
/// falcon_angles. Nothing: no place of the grip has these angles.
[[nodiscard]] std::optional<glm::dvec3> falcon_position(const FalconAngles&) noexcept;

/// Column i: d p_F / d theta_i [m/rad]. Nothing near a singular pose, where the shins' directions come into one plane
/// (motors cannot hold some force) or an arm is in line with its shin (it has no lever): see kLeastVolume,
/// kLeastLever_m.
[[nodiscard]] std::optional<glm::dmat3> falcon_jacobian(const glm::dvec3& p_F, const FalconAngles&) noexcept;

/// Of the three unit vectors along the shins. 0.36 to 0.89 in the workspace; forces in the shins grow as 1 / volume.
inline constexpr double kLeastVolume = 0.1;
inline constexpr double kLeastLever_m = 0.005;  ///< 0.021 to 0.060 in the workspace

/// The workspace is published as four inches: a ball of that diameter fits best about here.
inline constexpr glm::dvec3 kFalconMiddle_F_m{0, 0, 0.12};

struct FalconMotors {
  std::array<std::int16_t, 3> values{};
  double share =
      0;  ///< of the force that was asked for, 0 to 1: all motors go down together, so that its direction stays
};

/// tau = J^T F_F, as values of the motors. No force for what is not finite.
[[nodiscard]] FalconMotors falcon_motors(const glm::dmat3& jacobian, const glm::dvec3& force_F_N) noexcept;

inline constexpr double kFalconUnitsPerNm = 10'000;  ///< libnifalcon's scale; nobody published a measured one
inline constexpr double kMostFalconValue = 4096;     ///< of a motor, by libnifalcon's documents

}  // namespace farfeel::codecs
