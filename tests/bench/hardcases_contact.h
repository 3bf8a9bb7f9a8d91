// Hard cases of one contact frame, each judged against what is known in closed form or against the converged integral.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/penetration/reference/reference.h"

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

  [[nodiscard]] contact_service::ContactService service(const penetration::BackEndMaker& = {},
                                                        std::uint32_t samples = 50, double soft_width_m = 10e-6) const;
  /// The answer of a fresh service at a pose X_OT.
  [[nodiscard]] contact::ContactSet answer(const spatial::Pose& X_OT, const penetration::BackEndMaker& = {},
                                           std::uint32_t samples = 50, double soft_width_m = 10e-6) const;
};

/// The reference run so finely that it converges: seconds an answer.
inline const penetration::BackEndMaker kTruthMaker = penetration::reference_maker(penetration::kTruth);

inline const glm::dquat kTurnedOver{0, 1, 0, 0};  ///< half a turn about x: a plate that faces down
[[nodiscard]] contact_service::ToolPose pose_number(std::uint32_t i, const spatial::Pose& X_WT, double dt_s = 1e-3);
/// The deepest contact; a contact whose depth is no number when there is none.
[[nodiscard]] contact::Contact deepest_of(const contact::ContactSet&);
[[nodiscard]] bool is_finite(const contact::ContactSet&);
/// Difference of two wrenches as a share of the second; torque counts by its arm of 20 mm.
[[nodiscard]] double wrench_error(const spatial::Wrench&, const spatial::Wrench& truth);

/// What is judged by itself, apart from all others.
struct HardCase {
  std::string_view name;
  void (*judge)(HardCaseRows&);
};
[[nodiscard]] std::span<const HardCase> height_field_cases();  ///< plates and ridges: hardcases_plates.cpp
[[nodiscard]] std::span<const HardCase> solid_cases();         ///< pegs, threads, gears, edges: hardcases_solids.cpp
[[nodiscard]] std::span<const HardCase>
shell_cases();  ///< thin walls from both sides, rims, jabs: hardcases_shells.cpp
[[nodiscard]] std::span<const HardCase> closed_path_cases();  ///< what re-clustering makes: hardcases_energy.cpp
[[nodiscard]] std::vector<HardCase> contact_cases();          ///< all of them, in this order

}  // namespace farfeel::bench
