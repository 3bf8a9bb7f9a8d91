#include "haptic_core/constraint/recess.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/constraint/row_problem.h"

namespace farfeel::constraint {

double unmade_depth_m(const Row& row, const spatial::Pose& X_WQ, const spatial::Pose& X_WP, double made_m) noexcept {
  const double at_proxy_m = row.depth_m + row.gradient.dot(way_between(X_WQ, X_WP));
  return at_proxy_m > made_m ? at_proxy_m : 0;
}

LetIn to_let_in(const Row& row, double normal_N, double most_N, double budget_J) noexcept {
  const double k = row.stiffness_N_per_m;
  const double stretched_m = std::max(normal_N, 0.0) / k;
  // k/2 ((s + dr)^2 - s^2) = budget
  const double afforded_m = std::sqrt(stretched_m * stretched_m + 2 * std::max(budget_J, 0.0) / k) - stretched_m;
  LetIn in;
  in.recess_m = std::clamp(std::min(std::max(most_N, 0.0) / k, afforded_m), 0.0, std::max(row.recess_m, 0.0));
  in.costs_J = k * in.recess_m * (stretched_m + 0.5 * in.recess_m);
  return in;
}

}  // namespace farfeel::constraint
