// WoodenHaptics: packets of its mbed, and the geometry and statics of its arm.
//
// Source of the packets and figures: Forsslund et al., "WoodenHaptics: A Starting Kit for Crafting Force-Reflecting
// Spatial Haptic Devices", TEI 2015, and the authors' public library haptikfabrikenapi (configuration of 2015).
//
// Body a turns the arm about the vertical, body b swings the upper arm, body c the forearm, each by a wire round a
// capstan. With angles A, B, C of the bodies, in the arm's own axes (x towards the person, y to the right, z up):
//
//   reach = Lb sin B + Lc sin C
//   x = cos A reach,  y = sin A reach,  z = Ln + Lb cos B - Lc cos C,  all less the workspace's origin
//
// Frame B: x to the right, y away from the person, z up, so (x, y, z) of B is (y, -x, z) of the arm.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>

namespace farfeel::codecs {

inline constexpr std::size_t kWoodenHapticsReportBytes = 15;  ///< either way, with the id 0 that a channel adds

using WoodenHapticsPacket = std::array<std::byte, kWoodenHapticsReportBytes>;

struct WoodenHapticsAnswer {
  std::array<std::int16_t, 6> counts{};  ///< encoders a to f; d to f are those of a wrist, where there is one
  bool asks_to_home = false;             ///< the button of its board was pressed
};

/// Nothing unless it is of the right length, with id 0. Realtime-safe, as all below.
[[nodiscard]] std::optional<WoodenHapticsAnswer> read_wooden_haptics(std::span<const std::byte> report) noexcept;
[[nodiscard]] WoodenHapticsPacket wooden_haptics_currents(const std::array<std::int16_t, 3>& currents_mA) noexcept;
/// The encoders count on from these; the motors get no current meanwhile.
[[nodiscard]] WoodenHapticsPacket wooden_haptics_counts(const std::array<std::int16_t, 6>& counts) noexcept;

/// One arm. Three values each: bodies a, b and c.
struct WoodenHapticsArm {
  double base_height_m = 0.080, upper_arm_m = 0.205, forearm_m = 0.245;  ///< Ln, Lb, Lc
  glm::dvec3 capstan_diameter_m{0.010};
  glm::dvec3 body_diameter_m{0.160, 0.120, 0.120};
  glm::dvec3 counts_per_turn{2000};  ///< of a motor
  glm::dvec3 direction{1};           ///< +1 or -1: of the body, with the motor's counts and with its current
  glm::dvec3 torque_constant_Nm_per_A{0.0259};
  glm::dvec3 origin_m{0.220, 0, 0.080};  ///< of the workspace, in the arm's own axes
  double max_current_A = 2;              ///< the authors' own cap, for the motor controllers' sake
  /// Counts when the upper arm stands upright and the forearm lies level, straight towards the person.
  std::array<std::int16_t, 6> neutral_counts{0, 0, 6000, 0, 0, 0};
  /// What bodies can reach. Estimated: a device of one's own may do less. What lies outside is a wrong neutral pose.
  glm::dvec3 min_angle_rad{-2.1, -1.6, -0.6}, max_angle_rad{2.1, 2.1, 3.5};
};

[[nodiscard]] glm::dvec3 body_angles_rad(const WoodenHapticsArm&, const std::array<std::int16_t, 6>& counts) noexcept;
[[nodiscard]] bool can_reach(const WoodenHapticsArm&, const glm::dvec3& angles_rad) noexcept;
/// p_BD: the handle, from the middle of the workspace.
[[nodiscard]] glm::dvec3 handle_B_m(const WoodenHapticsArm&, const glm::dvec3& angles_rad) noexcept;
/// Columns: how the handle moves with each angle [m/rad]. Singular where the arm points straight up, or is stretched or
/// folded; statics needs no inverse of it.
[[nodiscard]] glm::dmat3 handle_jacobian_B(const WoodenHapticsArm&, const glm::dvec3& angles_rad) noexcept;

/// Motor currents for a force on the hand: torques = J^T F. Above max_current_A all three become smaller together, so
/// that the force keeps its direction. Zero for a force that is not finite. In a singular pose the part of the force
/// along the lost direction has no currents.
[[nodiscard]] std::array<std::int16_t, 3> motor_currents_mA(const WoodenHapticsArm&, const glm::dvec3& angles_rad,
                                                            const glm::dvec3& F_hand_B_N) noexcept;

}  // namespace farfeel::codecs
