// The twist that the tool moves with is V + share dV, so dV follows from what the contacts were solved for: no second
// LU.
#include "haptic_core/constraint/tool_step.h"

#include "haptic_core/constraint/mobility.h"
#include "haptic_core/constraint/proxy_shift.h"

namespace farfeel::constraint {

spatial::Pose where_to_look(const TouchingTool& touching, double dt_s, Pad pad) noexcept {
  if (pad == Pad::kSprings) return touching.tool.X_WT;
  return spatial::integrate(touching.X_WP, touching.tool.V_WT_W, dt_s);
}

TickReport take_tick(TouchingTool& touching, const tool::LinearResponse& others, std::span<const Row> rows,
                     const spatial::Pose& X_WQ, double dt_s, const Law& law, double afford_J,
                     tool::Integrator integrator) noexcept {
  TickReport report;
  const tool::LinearStep linear = tool::linear_step(touching.tool, others, dt_s, integrator);
  const Mobility moves = mobility(linear);
  solve_contacts(rows, X_WQ, touching.tool.X_WT, moves, law, afford_J, touching.memory, report.contacts);
  const spatial::Vector6 V_change = (report.contacts.V_moved - linear.V_begun) / linear.share;
  report.stepped = tool::take(touching.tool, linear, V_change);
  if (law.pad == Pad::kSprings) {
    touching.X_WP = touching.tool.X_WT;
    return report;
  }
  const double way_m = dt_s * report.contacts.V_moved.tail<3>().norm();
  const ProxyPose proxy = pushed_out(rows, report.contacts, {X_WQ, touching.tool.X_WT, touching.X_WP.p, way_m});
  touching.X_WP = proxy.X_WP;
  report.proxy_depth_m = proxy.depth_m;
  return report;
}

}  // namespace farfeel::constraint
