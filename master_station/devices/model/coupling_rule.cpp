#include "master_station/devices/model/coupling_rule.h"

#include <fmt/format.h>

#include <algorithm>

namespace farfeel::devices {
namespace {

constexpr double kTick_s = 1e-3;
constexpr double kShare = 0.8, kShareLimp = 0.85;
constexpr double kDampingShare = 0.25, kDampingShareLimp = 0.5;  // B / b, where there is a delay
constexpr double kFrictionDoubt = 0.5, kDelayDoubt = 1.5;        // of figures that nobody published

double exchange_s(const DeviceModel& model) noexcept {
  return model.rate_Hz > 0 ? 1 / model.rate_Hz : 0;
}

struct Spring {
  double stiffness = 0, damping = 0;
};

Spring by_rule(double friction, const DeviceModel& model, Grasp hand) noexcept {
  const bool is_limp = hand == Grasp::kLimp;
  const double late_s = delay_s(model);
  const double damping = late_s > 0 ? (is_limp ? kDampingShareLimp : kDampingShare) * friction : 0;
  const double hold_s = std::max(kTick_s, exchange_s(model));
  return {(is_limp ? kShareLimp : kShare) * (friction + damping) / (0.5 * hold_s + late_s), damping};
}

}  // namespace

double delay_s(const DeviceModel& model) noexcept {
  return model.sensor_delay_s + model.actuator_delay_s + exchange_s(model);
}

DeviceModel at_softer_end(const DeviceModel& model) {
  DeviceModel soft = model;
  const auto scale = [&](std::string_view name, double& figure, double by) {
    if (model.is_estimated(name)) figure *= by;
  };
  scale("viscous_friction_Ns_per_m", soft.viscous_friction_Ns_per_m, kFrictionDoubt);
  scale("viscous_friction_Nms_per_rad", soft.viscous_friction_Nms_per_rad, kFrictionDoubt);
  scale("sensor_delay_s", soft.sensor_delay_s, kDelayDoubt);
  scale("actuator_delay_s", soft.actuator_delay_s, kDelayDoubt);
  scale("rate_Hz", soft.rate_Hz, 1 / kDelayDoubt);
  return soft;
}

Coupling coupling_of(const DeviceModel& model, Grasp hand) {
  const DeviceModel soft = at_softer_end(model);
  Coupling coupling;
  if (model.force_dof > 0) {
    const Spring spring = by_rule(soft.viscous_friction_Ns_per_m, soft, hand);
    coupling.stiffness_N_per_m = spring.stiffness, coupling.damping_Ns_per_m = spring.damping;
  }
  if (model.torque_dof > 0) {
    const Spring spring = by_rule(soft.viscous_friction_Nms_per_rad, soft, hand);
    coupling.stiffness_Nm_per_rad = spring.stiffness, coupling.damping_Nms_per_rad = spring.damping;
  }
  if (model.coupling_stiffness_N_per_m > 0) {
    coupling.stiffness_N_per_m = model.coupling_stiffness_N_per_m;
    coupling.damping_Ns_per_m = model.coupling_damping_Ns_per_m;
    coupling.is_identified = true;
  }
  if (model.coupling_stiffness_Nm_per_rad > 0) {
    coupling.stiffness_Nm_per_rad = model.coupling_stiffness_Nm_per_rad;
    coupling.damping_Nms_per_rad = model.coupling_damping_Nms_per_rad;
  }
  return coupling;
}

std::string in_words(const DeviceModel& model, const Coupling& coupling, Grasp hand) {
  if (model.force_dof == 0) return fmt::format("{} gives no force", model.title);
  std::string words = fmt::format("{} is coupled with {:.0f} N/m and {:.2g} Ns/m", model.title,
                                  coupling.stiffness_N_per_m, coupling.damping_Ns_per_m);
  if (model.torque_dof > 0)
    words +=
        fmt::format(", {:.2g} Nm/rad and {:.2g} Nms/rad", coupling.stiffness_Nm_per_rad, coupling.damping_Nms_per_rad);
  if (coupling.is_identified) {
    words += ", as its data says was found calm";
  } else {
    const DeviceModel soft = at_softer_end(model);
    words += fmt::format(", by its friction of {:.2g} Ns/m and its delay of {:.2g} ms", soft.viscous_friction_Ns_per_m,
                         1e3 * delay_s(soft));
    std::string doubts;
    const auto doubt = [&](std::string_view figure, std::string_view words_of_it) {
      if (model.is_estimated(figure)) doubts += fmt::format("{}{}", doubts.empty() ? "" : ", ", words_of_it);
    };
    doubt("viscous_friction_Ns_per_m", "its friction (taken at half)");
    doubt("sensor_delay_s", "its sensor's delay (half as long again)");
    doubt("actuator_delay_s", "its actuators' delay (half as long again)");
    doubt("rate_Hz", "its rate (two thirds)");
    if (!doubts.empty())
      words += fmt::format("; nobody published {}: 'farfeel device identify-limits' may find it stiffer", doubts);
  }
  if (hand == Grasp::kLimp && !coupling.is_identified) words += "; for a limp hand, stiffer and more damped";
  if (model.torque_dof == 0) words += "; it cannot turn the hand: torque is masked, and told";
  if (!model.is_in_newtons) words += "; its force is not in newtons until it is calibrated";
  return words;
}

master_station::DeviceCapabilities capabilities_of(const DeviceModel& model, Grasp hand) {
  const Coupling coupling = coupling_of(model, hand);
  master_station::DeviceCapabilities device;
  device.name = model.name;
  device.pose_dof = model.position_dof + model.rotation_dof;
  device.force_dof = model.force_dof;
  device.torque_dof = model.torque_dof;
  device.max_force_N = model.max_force_N;
  device.max_torque_Nm = model.max_torque_Nm;
  device.max_force_rate_N_per_s = model.max_force_rate_N_per_s;
  device.max_power_W = model.max_power_W;
  device.max_speed_m_s = model.max_speed_m_s;
  device.position_step_m = model.position_step_m;
  device.rotation_step_rad = model.rotation_step_rad;
  device.stable_stiffness_N_per_m = coupling.stiffness_N_per_m;
  device.stable_damping_Ns_per_m = coupling.damping_Ns_per_m;
  device.stable_rotational_stiffness_Nm_per_rad = coupling.stiffness_Nm_per_rad;
  device.stable_rotational_damping_Nms_per_rad = coupling.damping_Nms_per_rad;
  device.delay_s = delay_s(model);
  device.exchange_s = exchange_s(model);
  return device;
}

}  // namespace farfeel::devices
