// The sessions that every refactoring replays: small scenes in closed form, each with a hand that is told where to go.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/local_model/local_model.h"
#include "haptic_core/motion/scripted_motion.h"
#include "haptic_core/teleoperation/controller.h"
#include "haptic_core/tool/rigid_tool.h"
#include "master_station/devices/grip.h"
#include "transport/link/link_spec.h"

namespace farfeel::bench {

struct SessionBody {
  geometry::HapticSurface surface;
  contact::Material material{};
  spatial::Pose X_WO{};
  std::optional<motion::ScriptedMotion> motion = {};
};

struct SessionToRecord {
  std::string name;                 ///< of its file
  std::vector<SessionBody> bodies;  ///< the tool, then the objects
  double tolerance_m = 2e-3;
  spatial::Pose X_start;  ///< of the tool in W
  /// Where the hand wants the tool, from 0 (begins to move) to 1 (the end).
  std::function<spatial::Pose(double)> X_wanted;
  double lean_N = 0;  ///< at the end, along push_W
  glm::dvec3 push_W{0, 0, -1};

  local_model::Rung rung = local_model::Rung::kTiles;
  teleoperation::Controller controller = teleoperation::Controller::kOurs;
  bool has_outline = true;
  bool is_historical = false;
  transport::LinkSpec link{};
  master_station::Grip grip = master_station::kMediumGrip;
  tool::MassProperties body{};  ///< of the tool
  std::int64_t tick_ns = 1'000'000;
  double length_s = 1.2;
  tool::Integrator integrator = tool::Integrator::kBackwardEuler;

  // What happens; 0: it does not.
  double late_share = 0;      ///< of the ticks, drawn by lot, work longer than their period; tiles may rest then
  double edits_from_s = 0;    ///< from then on the first object's tiles change, one a tick
  double unplugged_at_s = 0;  ///< the device is, for kUnplugged_s, and is reset as long afterwards
  double stalls_at_s = 0;     ///< no tick for kStalled_s
  static constexpr double kUnplugged_s = 0.1, kStalled_s = 0.06;
};

[[nodiscard]] std::vector<SessionToRecord> sessions_to_record();

}  // namespace farfeel::bench
