// A handle, the coupling, a tool and closed-form rows, tick by tick: for tests and benchmarks of the constraint law.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "haptic_core/constraint/tool_step.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/tool/virtual_coupling.h"

namespace farfeel::test_support {

/// Adds the rows of a tool at X_WQ.
using Scene = std::function<void(const spatial::Pose& X_WQ, std::vector<constraint::Row>&)>;

struct Stuff {
  double stiffness_N_per_m = 1000;
  double damping_Ns_per_m = 0.25;
  double friction = 0;  ///< static and dynamic
};

/// The tool's point p_ToC_T against the half-space below nhat_W.x = height_m.
[[nodiscard]] constraint::Row point_on_plane(const spatial::Pose& X_WQ, const glm::dvec3& p_ToC_T,
                                             const glm::dvec3& nhat_W, double height_m, const Stuff& = {});
/// A tool's cylinder about its z axis, at p_ToC_T on that axis, in a bore about W's z axis without play: the row
/// towards outward_W, a unit vector across z.
[[nodiscard]] constraint::Row pin_in_bore(const spatial::Pose& X_WQ, const glm::dvec3& p_ToC_T, double radius_m,
                                          const glm::dvec3& outward_W, const Stuff& = {});

/// Names rows 1, 2, ... in order.
void name_in_order(std::vector<constraint::Row>&);

class RowLoop {
 public:
  RowLoop(const tool::MassProperties& body, const tool::CouplingGains& gains, const constraint::Law& law, double dt_s,
          const spatial::Pose& X_WT, const spatial::Pose& X_TG = {});

  /// One tick; the handle's twist is what it moved since the last.
  const constraint::TickReport& tick(const spatial::Pose& X_WD, const Scene&);
  /// The same without a handle: a force on the tool at To.
  const constraint::TickReport& push(const glm::dvec3& force_W, const Scene&);

  [[nodiscard]] const constraint::TouchingTool& touching() const { return touching_; }
  [[nodiscard]] const spatial::Wrench& on_hand() const { return F_hand_W_; }
  [[nodiscard]] const constraint::TickReport& report() const { return report_; }
  [[nodiscard]] std::span<const constraint::Row> rows() const { return rows_; }
  [[nodiscard]] double normal_sum_N() const;
  [[nodiscard]] double dt_s() const { return dt_s_; }
  [[nodiscard]] const constraint::Law& law() const { return law_; }
  /// What each tick's step took, without the scene.
  [[nodiscard]] const std::vector<double>& step_us() const { return step_us_; }

 private:
  void take(const tool::LinearResponse& others, const Scene&);

  tool::VirtualCoupling coupling_;
  constraint::Law law_;
  double dt_s_;
  constraint::TouchingTool touching_;
  spatial::Pose X_WD_;
  bool has_handle_ = false;
  spatial::Wrench F_hand_W_;
  constraint::TickReport report_;
  std::vector<constraint::Row> rows_;
  std::vector<double> step_us_;
};

}  // namespace farfeel::test_support
