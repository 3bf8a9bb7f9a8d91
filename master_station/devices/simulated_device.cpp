// A mass with viscous and Coulomb friction, encoders that count and a force that is held from tick to tick: the model
// of Diolaiti, Niemeyer, Barbagli & Salisbury, IEEE T-RO 22(2), 2006, in six degrees of freedom. Its figures are no
// device's own: of the order of desktop devices, but for the viscous friction, which is more than most have, because it
// alone says here how stiff a coupling is stable (the constructor). The hand's mass and grip: grip.h; its delay:
// explorer.cpp.
#include "master_station/devices/simulated_device.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::master_station {
namespace {

constexpr std::int64_t kMaxCatchUp_ns = 100'000'000;
constexpr double kSubstep_s = static_cast<double>(SimulatedDevice::kSubstep_ns) * 1e-9;
// Coulomb friction is smooth below these speeds: a sign function would chatter at any step length.
constexpr double kFrictionKnee_m_s = 1e-3, kFrictionKnee_rad_s = 0.02;

glm::dvec3 friction(const glm::dvec3& velocity, double coulomb, double viscous, double knee) {
  return -(coulomb / std::hypot(glm::length(velocity), knee) + viscous) * velocity;
}

/// The explorer plans where the tool goes: there, a scaled hand is stiffer by what it moves less.
ExplorerSettings with_hand(const SimulatedDeviceSettings& settings) {
  ExplorerSettings explorer = settings.explorer;
  explorer.hand_stiffness_N_per_m = settings.grip.stiffness_N_per_m / settings.workspace_scale;
  return explorer;
}

glm::dvec3 rounded(const glm::dvec3& v, double step) {
  return step > 0 ? step * glm::round(v / step) : v;
}

}  // namespace

SimulatedDevice::SimulatedDevice(const SimulatedDeviceSettings& settings)
    : settings_(settings), explorer_(with_hand(settings)) {
  capabilities_.name = "simulated";
  capabilities_.max_force_N = settings.max_force_N;
  capabilities_.max_torque_Nm = settings.max_torque_Nm;
  capabilities_.max_force_rate_N_per_s = 2000;
  capabilities_.max_power_W = 10;
  capabilities_.max_speed_m_s = 2;
  capabilities_.position_step_m = settings.encoder_step_m;
  capabilities_.rotation_step_rad = settings.encoder_step_rad;
  // Colgate & Schenkel 1997: physical damping > K T / 2 + B, here with the damping of the device alone and T = 1 ms.
  constexpr double kTick_s = 1e-3;
  capabilities_.stable_damping_Ns_per_m = 0.5 * settings.viscous_friction_Ns_per_m;
  capabilities_.stable_stiffness_N_per_m = 2 * 0.5 * settings.viscous_friction_Ns_per_m / kTick_s;
  capabilities_.stable_rotational_damping_Nms_per_rad = 0.5 * settings.viscous_friction_Nms_per_rad;
  capabilities_.stable_rotational_stiffness_Nm_per_rad = 2 * 0.5 * settings.viscous_friction_Nms_per_rad / kTick_s;
  X_BHand_ = X_BD_ = intended_pose();
  last_reading_ = encoder_reading();
}

void SimulatedDevice::hold_at(const spatial::Pose& X_BHand) noexcept {
  X_BHand_ = X_BHand;
  V_BHand_B_ = {};
  is_holding_ = true;
}

spatial::Pose SimulatedDevice::intended_pose() const noexcept {
  const spatial::Pose X_WHand = explorer_.X_WHand();
  return {X_WHand.R, X_WHand.p / settings_.workspace_scale};
}

spatial::Pose SimulatedDevice::encoder_reading() const noexcept {
  return {spatial::rotation_from_vector(rounded(spatial::vector_from_rotation(X_BD_.R), settings_.encoder_step_rad)),
          rounded(X_BD_.p, settings_.encoder_step_m)};
}

void SimulatedDevice::substep() noexcept {
  if (time_ns_ >= next_intent_ns_) {
    next_intent_ns_ += static_cast<std::int64_t>(Explorer::kStep_s * 1e9);
    if (!is_holding_) {
      // The intent of the last millisecond ends here exactly; the next one is moved to along its own velocity.
      X_BHand_ = intended_pose();
      explorer_.advance(F_actuators_B_);
      V_BHand_B_ = explorer_.V_WHand_W();
      V_BHand_B_.linear_m_s /= settings_.workspace_scale;
    }
  }
  const Grip& grip = settings_.grip;
  const glm::dvec3 e = X_BHand_.p - X_BD_.p;
  const glm::dvec3 theta = spatial::vector_from_rotation(X_BHand_.R * glm::conjugate(X_BD_.R));
  const spatial::Wrench F_grip{
      grip.rotational_stiffness_Nm_per_rad * theta +
          grip.rotational_damping_Nms_per_rad * (V_BHand_B_.angular_rad_s - V_BD_B_.angular_rad_s),
      grip.stiffness_N_per_m * e + grip.damping_Ns_per_m * (V_BHand_B_.linear_m_s - V_BD_B_.linear_m_s)};
  const spatial::Wrench F_friction{friction(V_BD_B_.angular_rad_s, settings_.coulomb_friction_Nm,
                                            settings_.viscous_friction_Nms_per_rad, kFrictionKnee_rad_s),
                                   friction(V_BD_B_.linear_m_s, settings_.coulomb_friction_N,
                                            settings_.viscous_friction_Ns_per_m, kFrictionKnee_m_s)};
  const spatial::Wrench F = F_grip + F_friction + F_actuators_B_;
  const spatial::Twist before = V_BD_B_;
  V_BD_B_.angular_rad_s += kSubstep_s / settings_.inertia_kg_m2 * F.torque_Nm;
  V_BD_B_.linear_m_s += kSubstep_s / (settings_.mass_kg + grip.mass_kg) * F.force_N;
  X_BD_ = spatial::integrate(X_BD_, V_BD_B_, kSubstep_s);
  X_BHand_ = spatial::integrate(X_BHand_, V_BHand_B_, kSubstep_s);
  // The mean velocity of the substep makes the kinetic energy's balance exact.
  const spatial::Twist V{0.5 * (before.angular_rad_s + V_BD_B_.angular_rad_s),
                         0.5 * (before.linear_m_s + V_BD_B_.linear_m_s)};
  hand_port_.observe(F_grip, V, kSubstep_s);
  actuator_port_.observe(-1.0 * F_actuators_B_, V, kSubstep_s);
  time_ns_ += kSubstep_ns;
}

DeviceState SimulatedDevice::read(std::int64_t time_ns) noexcept {
  if (!has_started_) {
    has_started_ = true;
    time_ns_ = next_intent_ns_ = last_reading_ns_ = time_ns;
  }
  if (time_ns - time_ns_ > kMaxCatchUp_ns) {  // the time that was lost did not happen
    const std::int64_t lost_ns = time_ns - time_ns_ - kMaxCatchUp_ns;
    time_ns_ += lost_ns;
    next_intent_ns_ += lost_ns;
    last_reading_ns_ += lost_ns;
  }
  while (time_ns_ + kSubstep_ns <= time_ns) substep();

  const spatial::Pose reading = encoder_reading();
  const double dt_s = static_cast<double>(time_ns - last_reading_ns_) * 1e-9;
  if (dt_s > 0) {
    const double share = 1 - std::exp(-2 * std::numbers::pi * settings_.velocity_filter_Hz * dt_s);
    const glm::dvec3 angular = spatial::vector_from_rotation(reading.R * glm::conjugate(last_reading_.R)) / dt_s;
    const glm::dvec3 linear = (reading.p - last_reading_.p) / dt_s;
    velocity_estimate_.angular_rad_s += share * (angular - velocity_estimate_.angular_rad_s);
    velocity_estimate_.linear_m_s += share * (linear - velocity_estimate_.linear_m_s);
    last_reading_ = reading;
    last_reading_ns_ = time_ns;
  }
  return {reading, velocity_estimate_, true, is_clutch_held_};
}

void SimulatedDevice::write(const spatial::Wrench& F_hand_B) noexcept {
  F_actuators_B_ = spatial::is_finite(F_hand_B)
                       ? spatial::Wrench{spatial::no_longer_than(settings_.max_torque_Nm, F_hand_B.torque_Nm),
                                         spatial::no_longer_than(settings_.max_force_N, F_hand_B.force_N)}
                       : spatial::Wrench{};
}

}  // namespace farfeel::master_station
