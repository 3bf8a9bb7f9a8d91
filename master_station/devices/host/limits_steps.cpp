#include "master_station/devices/host/limits_steps.h"

#include <fmt/format.h>

#include <algorithm>

#include "master_station/devices/model/coupling_rule.h"

namespace farfeel::devices {
namespace {

constexpr double kLink_s = 1e-3;  // a command waits for the owner's next step at most so long

}  // namespace

LimitsSteps::LimitsSteps(const DeviceFile& before, bool has_consent)
    : device_(before), has_consent_(has_consent), search_(settings()) {}

LimitsSearch::Settings LimitsSteps::settings() const {
  const DeviceModel model = at_softer_end(device_.model);
  LimitsSearch::Settings settings;
  settings.delay_s = delay_s(model) + kLink_s;
  settings.damping_Ns_per_m = model.viscous_friction_Ns_per_m / 4;  // the rule's, of a device with delay
  settings.position_step_m = model.position_step_m;
  return settings;
}

double LimitsSteps::cap_N() const noexcept {
  return std::min(LimitsSearch::kMostForce_N, device_.model.max_force_N);
}

void LimitsSteps::end_axis(Turn& turn) {
  const double taken = search_.taken_N_per_m();
  turn.say.push_back(fmt::format("  {} to {}: {:.0f} N/m held ({}); taken are {:.0f} N/m, after {} kicks.",
                                 kDirections[axis_][0], kDirections[axis_][1], search_.held_N_per_m(),
                                 in_words(*search_.outcome()), taken, search_.trials()));
  if (taken <= 0) {
    turn.say.push_back("Nothing is kept: the coupling stays what the rule tells from the model's figures.");
    turn.is_over = true;
    return;
  }
  softest_N_per_m_ = axis_ == 0 ? taken : std::min(softest_N_per_m_, taken);
  if (++axis_ < std::min(device_.model.force_dof, 3)) {
    search_ = LimitsSearch(settings());
    turn.say.push_back(fmt::format("Next {} to {}.", kDirections[axis_][0], kDirections[axis_][1]));
    return;
  }
  result_ = device_;
  result_->model.coupling_stiffness_N_per_m = softest_N_per_m_;
  result_->model.coupling_damping_Ns_per_m = settings().damping_Ns_per_m;
  turn.is_over = true;
}

Turn LimitsSteps::step(std::int64_t now_ns, const Sample& sample, const Heard& heard) {
  Turn turn;
  if (!has_begun_) {
    has_begun_ = true;
    if (device_.model.force_dof == 0 || !device_.model.is_in_newtons || device_.model.tells != Tells::kPose) {
      turn.say.push_back("This device has no force in newtons: there is nothing to identify.");
      turn.is_over = true;
      return turn;
    }
    turn.say.push_back(
        fmt::format("The handle is kicked some hundred times with at most {:.0f} N, and a spring that gets stiffer and "
                    "stiffer holds "
                    "it where it is; each kick ends before it has given 1 mJ. Hold the {} lightly and let the handle "
                    "rest, for some "
                    "minutes; let go at any time, it waits. Torque is not looked at.{}",
                    LimitsSearch::kMostKick_N, device_.model.enable_button >= 0 ? "grip button" : "space bar",
                    has_consent_ ? "" : " Type yes to consent."));
  }
  if (!has_consent_) {
    turn.waits_for = WaitsFor::kLine;
    if (!heard.line) return turn;
    has_consent_ = is_yes(*heard.line);
    if (!has_consent_) {
      turn.say.push_back("No consent, no force.");
      turn.is_over = true;
    }
    return turn;
  }
  turn.waits_for = WaitsFor::kHold;
  turn.force_N[axis_] = search_.step(now_ns, {sample.X_BD.p[axis_], sample.V_BD_B.linear_m_s[axis_], heard.is_held});
  if (const double now = search_.trying_N_per_m(); now != told_N_per_m_ && heard.is_held) {
    told_N_per_m_ = now;
    turn.say.push_back(fmt::format("  trying {:.0f} N/m", now));
  }
  if (search_.outcome()) {
    turn.force_N = glm::dvec3(0);
    end_axis(turn);
  }
  return turn;
}

}  // namespace farfeel::devices
