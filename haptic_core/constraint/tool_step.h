// One tick of a rigid tool against rows: the implicit step of haptic_core/tool, with the rows' forces in it, and the
// proxy.
//
//   q = where_to_look(tool, dt)      the proxy's pose as the tick will leave it: p + h v
//   rows at q                         from surfaces, or from what was told of them
//   take_tick(tool, coupling, rows, q, dt, law)
//
// Where the look is at the tick's beginning instead, a ridge is found a tick late. The coupling's response is never
// changed by contacts; the matrix A has no contact in it.
#pragma once

#include <limits>
#include <span>

#include "haptic_core/constraint/contact_forces.h"
#include "haptic_core/constraint/row.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/tool/linear_response.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::constraint {

/// The tool that has mass and may sink into the pad, the proxy that stays on the surface, and what rows pushed with.
struct TouchingTool {
  tool::RigidTool tool;
  spatial::Pose X_WP;  ///< the proxy: the tool's rotation, shifted. That is where depths and pictures belong
  ContactMemory memory;
};

/// Where it touches nothing: the proxy is the tool.
[[nodiscard]] inline TouchingTool untouched(const tool::RigidTool& tool) noexcept {
  return {tool, tool.X_WT, {}};
}

/// Where to look rows up for the next tick. kSprings has no proxy and looks at the tick's beginning, as penalty does.
[[nodiscard]] spatial::Pose where_to_look(const TouchingTool&, double dt_s, Pad = Pad::kOne) noexcept;

struct TickReport {
  tool::StepWork stepped;
  ContactForces contacts;    ///< F_To_W times stepped.V_moved dt is the rows' work on the tool
  double proxy_depth_m = 0;  ///< by the rows, at the proxy: above rounding only where they leave no room
};

/// Moves the tool for dt_s > 0 under `others` (the coupling; without contacts) and the rows, looked up at X_WQ.
/// afford_J, >= 0: what depths that are news to the pad may make. Bounded time, no allocation; realtime-safe. Not
/// finite input gives a not finite tool: check before.
TickReport take_tick(TouchingTool&, const tool::LinearResponse& others, std::span<const Row> rows,
                     const spatial::Pose& X_WQ, double dt_s, const Law&,
                     double afford_J = std::numeric_limits<double>::infinity(),
                     tool::Integrator integrator = tool::Integrator::kBackwardEuler) noexcept;

}  // namespace farfeel::constraint
