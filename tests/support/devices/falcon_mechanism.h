// The Falcon's arms, motors and a hand on its grip, simulated from the published figures alone: nothing here is shared
// with the driver or its codec.
//
// Frame F: x to the right, y up, z towards the person, origin in the middle of the base. The arms are at 105, -15 and
// -135 degrees about z. Geometry: libnifalcon's table (after Stamper's thesis, 1997); the encoder: 320 slots, four
// counts a slot, 14.25 mm shaft against a drum of 110 mm, 35 degrees at count 0.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

namespace farfeel::test_support {

/// Angles of the three arms [rad] for the grip at p_F [m], by the law of cosines in each arm's plane; nothing where an
/// arm cannot reach.
[[nodiscard]] std::optional<std::array<double, 3>> falcon_arm_angles(const glm::dvec3& p_F);

/// What the hand does: a spring and damper to a place, and a force besides.
struct FalconHand {
  glm::dvec3 target_F_m{0, 0, 0.115};
  double stiffness_N_per_m = 0, damping_Ns_per_m = 0;
  glm::dvec3 force_F_N{0, 0, 0};
};

struct FalconMechanics {
  double mass_kg = 0.5;  ///< felt at the grip: nobody published it
  double viscous_friction_Ns_per_m = 1;
  double stop_radius_m = 0.0535, stop_middle_m = 0.12;  ///< a ball about z, a little over the four inches published
  double stop_stiffness_N_per_m = 5000, stop_damping_Ns_per_m = 30;
};

class FalconMechanism {
 public:
  static constexpr std::int64_t kSubstep_ns = 50'000;
  static constexpr double kNewtonMetresAUnit = 1e-4;  ///< of a motor's value; libnifalcon's scale

  explicit FalconMechanism(const FalconMechanics& = {}, const glm::dvec3& p_F = {0, 0, 0.1});

  /// Simulates on to now_ns, at most 50 ms at once; the first call starts the clock.
  void advance(std::int64_t now_ns);
  void set_hand(const FalconHand& hand) { hand_ = hand; }
  void set_motors(const std::array<std::int16_t, 3>& motors) { motors_ = motors; }

  [[nodiscard]] const glm::dvec3& position_F_m() const { return p_F_; }
  [[nodiscard]] const glm::dvec3& velocity_F_m_s() const { return v_F_; }
  [[nodiscard]] const std::array<double, 3>& angles_rad() const { return angles_rad_; }
  /// Force of the motors on the grip: F_j = sum tau_i d theta_i / d p_j, by differences of the arms' angles.
  [[nodiscard]] glm::dvec3 motor_force_F_N() const;

 private:
  FalconMechanics mechanics_;
  FalconHand hand_;
  std::array<std::int16_t, 3> motors_{};
  std::array<double, 3> angles_rad_{};
  glm::dvec3 p_F_, v_F_{0, 0, 0};
  std::int64_t time_ns_ = 0;
};

}  // namespace farfeel::test_support
