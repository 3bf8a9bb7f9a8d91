// A mass with viscous and Coulomb friction, encoders that count and a force that is held from tick to tick: the model
// of Diolaiti, Niemeyer, Barbagli & Salisbury, IEEE T-RO 22(2), 2006, in six degrees of freedom. Its figures
// are those of its model (model/simulated.toml unless told). The hand's mass and grip: grip.h; its delay:
// explorer.cpp.
#include "master_station/devices/simulated_device.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::master_station {
namespace {

constexpr std::int64_t kMaxCatchUp_ns = 100'000'000;
constexpr double kLeastInertia_kg_m2 = 1e-5;         // of a handle whose model does not tell, for nobody feels it turn
constexpr std::int64_t kExchangeAhead_ns = 260'000;  // of an exchange of its own to the tick: any will do
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

std::size_t substeps_in(double delay_s) {
  return static_cast<std::size_t>(std::lround(delay_s / kSubstep_s));
}

/// Puts one in and takes out the one that went in as many calls ago as there are places.
template <typename T>
T passed_through(std::vector<T>& ring, std::size_t& next, const T& value) noexcept {
  if (ring.empty()) return value;
  const T oldest = ring[next];
  ring[next] = value;
  next = next + 1 < ring.size() ? next + 1 : 0;
  return oldest;
}

/// The first n axes alone.
glm::dvec3 along(int n, const glm::dvec3& v) noexcept {
  return {n > 0 ? v.x : 0, n > 1 ? v.y : 0, n > 2 ? v.z : 0};
}

}  // namespace

SimulatedDevice::SimulatedDevice(const SimulatedDeviceSettings& settings)
    : settings_(settings),
      capabilities_(devices::capabilities_of(settings_.model, settings.hand)),
      explorer_(with_hand(settings)),
      poses_late_(substeps_in(settings.model.sensor_delay_s)),
      wrenches_late_(substeps_in(settings.model.actuator_delay_s)),
      exchange_ns_(settings.model.rate_Hz > 0 ? std::llround(1e9 / settings.model.rate_Hz) : 0) {
  start_at(intended_pose());
  is_holding_ = false;
}

void SimulatedDevice::start_at(const spatial::Pose& X_BHand) noexcept {
  hold_at(X_BHand);
  X_BD_ = X_BHand;
  R_BD_start_ = X_BD_.R;
  last_reading_ = encoder_reading();
  std::fill(poses_late_.begin(), poses_late_.end(), last_reading_);
}

void SimulatedDevice::hold_at(const spatial::Pose& X_BHand, const spatial::Twist& V_BHand_B) noexcept {
  X_BHand_ = X_BHand;
  V_BHand_B_ = V_BHand_B;
  is_holding_ = true;
}

void SimulatedDevice::grip_as(const Grip& grip) noexcept {
  const double mass_kg = settings_.grip.mass_kg;
  settings_.grip = grip;
  settings_.grip.mass_kg = mass_kg;
}

spatial::Pose SimulatedDevice::intended_pose() const noexcept {
  const spatial::Pose X_WHand = explorer_.X_WHand();
  return {X_WHand.R, X_WHand.p / settings_.workspace_scale - settings_.p_WB};
}

spatial::Pose SimulatedDevice::encoder_reading() const noexcept {
  // A turn that it does not measure is taken to be none: the mapping holds the tool as it was taken up.
  const devices::DeviceModel& model = settings_.model;
  const glm::dquat R =
      model.rotation_dof > 0
          ? spatial::rotation_from_vector(rounded(spatial::vector_from_rotation(X_BD_.R), model.rotation_step_rad))
          : R_BD_start_;
  return {R, along(model.position_dof, rounded(X_BD_.p, model.position_step_m))};
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
  if (exchange_ns_ > 0 && time_ns_ >= next_exchange_ns_) {
    next_exchange_ns_ += exchange_ns_;
    take_reading(time_ns_);
    F_sent_B_ = F_written_B_;
  }
  F_actuators_B_ = passed_through(wrenches_late_, next_late_wrench_, F_sent_B_);
  const Grip& grip = settings_.grip;
  const glm::dvec3 e = X_BHand_.p - X_BD_.p;
  const glm::dvec3 theta = spatial::vector_from_rotation(X_BHand_.R * glm::conjugate(X_BD_.R));
  const spatial::Wrench F_grip{
      grip.rotational_stiffness_Nm_per_rad * theta +
          grip.rotational_damping_Nms_per_rad * (V_BHand_B_.angular_rad_s - V_BD_B_.angular_rad_s),
      grip.stiffness_N_per_m * e + grip.damping_Ns_per_m * (V_BHand_B_.linear_m_s - V_BD_B_.linear_m_s)};
  const spatial::Wrench F_friction{friction(V_BD_B_.angular_rad_s, settings_.model.coulomb_friction_Nm,
                                            settings_.model.viscous_friction_Nms_per_rad, kFrictionKnee_rad_s),
                                   friction(V_BD_B_.linear_m_s, settings_.model.coulomb_friction_N,
                                            settings_.model.viscous_friction_Ns_per_m, kFrictionKnee_m_s)};
  const spatial::Wrench F = F_grip + F_friction + F_actuators_B_;
  const spatial::Twist before = V_BD_B_;
  V_BD_B_.angular_rad_s += kSubstep_s / std::max(settings_.model.inertia_kg_m2, kLeastInertia_kg_m2) * F.torque_Nm;
  V_BD_B_.linear_m_s += kSubstep_s / (settings_.model.mass_kg + grip.mass_kg) * F.force_N;
  X_BD_ = spatial::integrate(X_BD_, V_BD_B_, kSubstep_s);
  X_BHand_ = spatial::integrate(X_BHand_, V_BHand_B_, kSubstep_s);
  // The mean velocity of the substep makes the kinetic energy's balance exact.
  const spatial::Twist V{0.5 * (before.angular_rad_s + V_BD_B_.angular_rad_s),
                         0.5 * (before.linear_m_s + V_BD_B_.linear_m_s)};
  hand_port_.observe(F_grip, V, kSubstep_s);
  actuator_port_.observe(-1.0 * F_actuators_B_, V, kSubstep_s);
  time_ns_ += kSubstep_ns;
  if (!poses_late_.empty()) (void)passed_through(poses_late_, next_late_pose_, encoder_reading());
}

/// Of what the encoders said one sensor's delay ago; the velocity is that of a driver, from reading to reading.
void SimulatedDevice::take_reading(std::int64_t time_ns) noexcept {
  const spatial::Pose reading = poses_late_.empty() ? encoder_reading() : poses_late_[next_late_pose_];
  const double dt_s = static_cast<double>(time_ns - last_reading_ns_) * 1e-9;
  if (dt_s <= 0) return;
  const double share = 1 - std::exp(-2 * std::numbers::pi * settings_.velocity_filter_Hz * dt_s);
  const glm::dvec3 angular = spatial::vector_from_rotation(reading.R * glm::conjugate(last_reading_.R)) / dt_s;
  const glm::dvec3 linear = (reading.p - last_reading_.p) / dt_s;
  velocity_estimate_.angular_rad_s += share * (angular - velocity_estimate_.angular_rad_s);
  velocity_estimate_.linear_m_s += share * (linear - velocity_estimate_.linear_m_s);
  last_reading_ = reading;
  last_reading_ns_ = time_ns;
}

DeviceState SimulatedDevice::read(std::int64_t time_ns) noexcept {
  if (!has_started_) {
    has_started_ = true;
    time_ns_ = next_intent_ns_ = last_reading_ns_ = time_ns;
    next_exchange_ns_ = time_ns + kExchangeAhead_ns;
    gripped_from_ns_ = time_ns + 1;  // the next reading tells of the grip's edge
  }
  if (time_ns - time_ns_ > kMaxCatchUp_ns) {  // the time that was lost did not happen
    const std::int64_t lost_ns = time_ns - time_ns_ - kMaxCatchUp_ns;
    time_ns_ += lost_ns;
    next_intent_ns_ += lost_ns;
    last_reading_ns_ += lost_ns;
    next_exchange_ns_ += lost_ns;
  }
  while (time_ns_ + kSubstep_ns <= time_ns) substep();

  if (exchange_ns_ == 0) take_reading(time_ns);
  DeviceState state{last_reading_, velocity_estimate_, true, is_clutch_held_};
  const int button = std::max(0, settings_.model.enable_button);
  state.buttons = time_ns_ >= gripped_from_ns_ ? 1U << static_cast<unsigned>(button) : 0U;
  state.time_ns = last_reading_ns_;
  return state;
}

spatial::Wrench SimulatedDevice::possible(const spatial::Wrench& F) const noexcept {
  const devices::DeviceModel& model = settings_.model;
  if (!spatial::is_finite(F)) return {};
  return {spatial::no_longer_than(model.max_torque_Nm, along(model.torque_dof, F.torque_Nm)),
          spatial::no_longer_than(model.max_force_N, along(model.force_dof, F.force_N))};
}

void SimulatedDevice::write(const spatial::Wrench& F_hand_B) noexcept {
  F_written_B_ = possible(F_hand_B);
  if (exchange_ns_ > 0) return;
  F_sent_B_ = F_written_B_;
  if (wrenches_late_.empty()) F_actuators_B_ = F_sent_B_;
}

}  // namespace farfeel::master_station
