#include "tests/support/devices/falcon_mechanism.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::test_support {

namespace {

constexpr double kUpperArm_m = 0.060, kShin_m = 0.1025, kJoints_m = 2 * 0.01125;
constexpr double kGripOut_m = 0.01443, kGripAlong_m = -0.025;  // from a shin's end to the grip's middle
constexpr double kBaseOut_m = 0.040, kBaseAlong_m = -0.02309;
constexpr std::array<double, 3> kArms_deg{105, -15, -135};

glm::dvec3 stops(const FalconMechanics& is, const glm::dvec3& p, const glm::dvec3& v) {
  const glm::dvec3 from_middle = p - glm::dvec3(0, 0, is.stop_middle_m);
  const double radius = glm::length(from_middle);
  if (radius <= is.stop_radius_m) return glm::dvec3(0);
  const glm::dvec3 out = from_middle / radius;
  const double damping_N = is.stop_damping_Ns_per_m * std::max(0.0, glm::dot(v, out));
  return -out * (is.stop_stiffness_N_per_m * (radius - is.stop_radius_m) + damping_N);
}

}  // namespace

std::optional<std::array<double, 3>> falcon_arm_angles(const glm::dvec3& p_F) {
  std::array<double, 3> angles{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double phi = kArms_deg[i] * std::numbers::pi / 180;
    const double out = std::cos(phi) * p_F.x + std::sin(phi) * p_F.y - kBaseOut_m + kGripOut_m;
    const double along = -std::sin(phi) * p_F.x + std::cos(phi) * p_F.y - kBaseAlong_m + kGripAlong_m;
    if (std::abs(along) > kShin_m) return std::nullopt;
    // In the arm's plane: a triangle of upper arm, shin with its two joints, and the line from shoulder to grip.
    const double shin = kJoints_m + std::sqrt(kShin_m * kShin_m - along * along);
    const double line = std::hypot(out, p_F.z);
    const double cosine = (kUpperArm_m * kUpperArm_m + line * line - shin * shin) / (2 * kUpperArm_m * line);
    if (!(std::abs(cosine) <= 1)) return std::nullopt;
    angles[i] = std::atan2(p_F.z, out) - std::acos(cosine);
  }
  return angles;
}

FalconMechanism::FalconMechanism(const FalconMechanics& mechanics, const glm::dvec3& p_F)
    : mechanics_(mechanics), p_F_(p_F) {
  if (const auto angles = falcon_arm_angles(p_F_)) angles_rad_ = *angles;
}

glm::dvec3 FalconMechanism::motor_force_F_N() const {
  constexpr double kStep_m = 1e-6;
  glm::dvec3 force(0);
  for (int j = 0; j < 3; ++j) {
    glm::dvec3 step(0);
    step[j] = kStep_m;
    const auto ahead = falcon_arm_angles(p_F_ + step), behind = falcon_arm_angles(p_F_ - step);
    if (!ahead || !behind) return glm::dvec3(0);  // at the end of an arm's reach, which the stops keep away from
    for (std::size_t i = 0; i < 3; ++i) {
      // A positive value turns its arm back, towards the base.
      const double torque_Nm = -kNewtonMetresAUnit * motors_[i];
      force[j] += torque_Nm * ((*ahead)[i] - (*behind)[i]) / (2 * kStep_m);
    }
  }
  return force;
}

void FalconMechanism::advance(std::int64_t now_ns) {
  if (time_ns_ == 0 || now_ns - time_ns_ > 50'000'000) time_ns_ = now_ns - (time_ns_ == 0 ? 0 : 50'000'000);
  const double dt = kSubstep_ns * 1e-9;
  for (; time_ns_ + kSubstep_ns <= now_ns; time_ns_ += kSubstep_ns) {
    const glm::dvec3 hand = hand_.force_F_N + hand_.stiffness_N_per_m * (hand_.target_F_m - p_F_);
    const glm::dvec3 force = motor_force_F_N() + hand + stops(mechanics_, p_F_, v_F_);
    const double damping = mechanics_.viscous_friction_Ns_per_m + hand_.damping_Ns_per_m;
    v_F_ = (v_F_ + force * (dt / mechanics_.mass_kg)) / (1 + damping * dt / mechanics_.mass_kg);
    const glm::dvec3 next = p_F_ + v_F_ * dt;
    if (const auto angles = falcon_arm_angles(next)) {
      p_F_ = next;
      angles_rad_ = *angles;
    } else {
      v_F_ = glm::dvec3(0);
    }
  }
}

}  // namespace farfeel::test_support
