// The remote's end of a line: a tool that waves or velocities move, in contact with the scene.
#pragma once

#include "haptic_core/teleoperation/controller.h"
#include "haptic_core/teleoperation/time_domain_passivity.h"
#include "haptic_core/teleoperation/wave_budget.h"
#include "haptic_core/teleoperation/wave_variables.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::teleoperation {

/// For kWaves and kPassivity. Realtime-safe.
class RemoteEnd {
 public:
  RemoteEnd() : RemoteEnd(Controller::kWaves, {}, {}) {}
  /// The tool rests at X_WT.
  RemoteEnd(Controller controller, const tool::MassProperties& body, const spatial::Pose& X_WT)
      : controller_(controller), tool_{body, X_WT, {}} {}

  /// What arrived moves the tool for dt_s >= 0, against the contacts at its pose; returns what to send back.
  [[nodiscard]] LineValue answer(const LineValue& arrived, const tool::LinearResponse& contacts, double dt_s);

  [[nodiscard]] const tool::RigidTool& tool() const { return tool_; }
  [[nodiscard]] bool is_for(const LineValue& arrived) const { return controller_ == arrived.by; }

 private:
  Controller controller_;
  tool::RigidTool tool_;
  WaveTerminal terminal_{kLineImpedance_Nms_per_rad, kLineImpedance_Ns_per_m};
  WaveBudget budget_;
  PassivityEnd end_;
};

}  // namespace farfeel::teleoperation
