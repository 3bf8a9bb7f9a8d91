#include "haptic_core/constraint/recess.h"

#include "haptic_core/constraint/mobility.h"

namespace farfeel::constraint {

double unmade_depth_m(const Row& row, const spatial::Pose& X_WQ, const spatial::Pose& X_WP, double made_m) noexcept {
  const double at_proxy_m = row.depth_m + row.gradient.dot(way_between(X_WQ, X_WP));
  return at_proxy_m > made_m ? at_proxy_m : 0;
}

}  // namespace farfeel::constraint
