// Hard cases of one contact frame, each judged against what is known in closed form or against the converged integral.
#pragma once

#include <string>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::bench {

/// One figure of one case.
struct HardCaseRow {
  std::string name, figure;
  double value;
  std::string unit;
  double bound;  ///< value <= bound passes; what is not a number fails
  [[nodiscard]] bool passes() const { return value <= bound; }
};
using HardCaseRows = std::vector<HardCaseRow>;

/// A scene object and a tool by themselves. Both face each other along z, the tool from above, unless a case says so.
/// No friction.
struct Touching {
  geometry::HapticSurface s, t;
  double tolerance_m = 0.005;
  spatial::Pose X_WO;

  [[nodiscard]] contact_service::ContactService service(
      contact_service::DepthBackEnd back_end = contact_service::DepthBackEnd::kSimd, std::uint32_t samples = 50,
      double soft_width_m = 10e-6) const;
  /// The answer of a fresh service at a pose X_OT.
  [[nodiscard]] contact::ContactSet answer(
      const spatial::Pose& X_OT, contact_service::DepthBackEnd back_end = contact_service::DepthBackEnd::kSimd,
      std::uint32_t samples = 50, double soft_width_m = 10e-6) const;
};

inline const glm::dquat kTurnedOver{0, 1, 0, 0};  ///< half a turn about x: a plate that faces down
[[nodiscard]] contact_service::ToolPose pose_number(std::uint32_t i, const spatial::Pose& X_WT, double dt_s = 1e-3);
/// The deepest contact; a contact whose depth is no number when there is none.
[[nodiscard]] contact::Contact deepest_of(const contact::ContactSet&);
[[nodiscard]] bool is_finite(const contact::ContactSet&);
/// Difference of two wrenches as a share of the second; torque counts by its arm of 20 mm.
[[nodiscard]] double wrench_error(const spatial::Wrench&, const spatial::Wrench& truth);

void judge_height_fields(HardCaseRows&);  ///< plates and ridges: hardcases_plates.cpp
void judge_closed_paths(HardCaseRows&);   ///< what re-clustering makes: hardcases_energy.cpp
void judge_solids(HardCaseRows&);         ///< pegs, threads, gears, edges: hardcases_solids.cpp
void judge_shells(HardCaseRows&);         ///< thin walls from both sides, rims, jabs: hardcases_shells.cpp

}  // namespace farfeel::bench
