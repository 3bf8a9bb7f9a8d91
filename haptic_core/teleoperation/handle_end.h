// The operator's end of a line: from the handle's motion and what arrived, the force on the hand and what to send.
#pragma once

#include <optional>

#include "haptic_core/teleoperation/controller.h"
#include "haptic_core/teleoperation/time_domain_passivity.h"
#include "haptic_core/teleoperation/wave_budget.h"
#include "haptic_core/teleoperation/wave_variables.h"

namespace farfeel::teleoperation {

/// Realtime-safe.
class HandleEnd {
 public:
  explicit HandleEnd(Controller controller) : controller_(controller) {
    metric_ << Eigen::Vector3d::Constant(kDampingArm_m * kDampingArm_m), Eigen::Vector3d::Ones();
  }

  /// Whether the remote simulates the tool; else its contacts' wrench is all that arrives.
  [[nodiscard]] bool is_tool_remote() const { return controller_ != Controller::kDirect; }

  struct Step {
    spatial::Vector6 F_hand;
    LineValue out;
  };
  /// V: of the handle. Not for kOurs.
  [[nodiscard]] Step tick(const spatial::Vector6& V, const LineValue& arrived, double dt_s) {
    switch (controller_) {
      case Controller::kWaves: {
        budget_.learn(arrived.energy_in_J);
        const spatial::Vector6 in = budget_.afforded(arrived.value, dt_s), out = terminal_.out(V, in);
        budget_.send(out, dt_s);
        return {-terminal_.force(V, in), {out, budget_.sent_J(), controller_}};
      }
      case Controller::kPassivity: {
        end_.learn(arrived.energy_in_J);
        const spatial::Vector6 F = end_.damped_force(arrived.value, V, metric_, dt_s, kMostDamping_Ns_per_m);
        return {F, {V, end_.energy_in_J(), controller_}};
      }
      default:
        return {arrived.value, {V, 0}};
    }
  }

 private:
  Controller controller_;
  WaveTerminal terminal_{kLineImpedance_Nms_per_rad, kLineImpedance_Ns_per_m};
  WaveBudget budget_;
  PassivityEnd end_;
  spatial::Vector6 metric_;
};

/// None for kOurs, which renders a local model.
[[nodiscard]] inline std::optional<HandleEnd> make_handle_end(Controller controller) {
  return controller == Controller::kOurs ? std::nullopt : std::optional<HandleEnd>(controller);
}

}  // namespace farfeel::teleoperation
