#include "haptic_core/contact/depth/soft_widths.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/depth/constants.h"

namespace farfeel::contact {
namespace {

spatial::Vector6 with_arm(const spatial::Vector6& v, double arm_m) {
  spatial::Vector6 lengths = v;
  lengths.head<3>() /= arm_m;
  return lengths;
}

/// k (g g^T + depth H) with rotations as lengths.
spatial::Matrix6 stiffness_with_arm(double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                                    const spatial::Matrix6& hessian, double arm_m) {
  spatial::Matrix6 lengths = hessian;
  lengths.topRows<3>() /= arm_m;
  lengths.leftCols<3>() /= arm_m;
  const spatial::Vector6 g = with_arm(gradient, arm_m);
  return k_N_per_m * (g * g.transpose() + std::max(depth_m, 0.0) * lengths);
}

}  // namespace

// The norm of M^8 is the root of the sum of the eigenvalues' sixteenth powers: six of them are at most 6^(1/16) = 1.12
// times the largest. Those that are negative count by their size: they are seldom the largest.
double stiffness_bound_N_per_m(double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                               const spatial::Matrix6& hessian, double arm_m) noexcept {
  spatial::Matrix6 power = stiffness_with_arm(k_N_per_m, depth_m, gradient, hessian, arm_m);
  double exponent = 1, bound = 1;
  for (int squared = 0; squared <= 3; ++squared, exponent *= 0.5) {
    const double norm = power.norm();
    if (!(norm > 0) || !std::isfinite(norm)) return 0;
    bound *= std::pow(norm, exponent);
    if (squared == 3) break;
    power /= norm;
    power = (power * power).eval();
  }
  return bound;
}

double SoftWidths::width_m(std::uint32_t id) const noexcept {
  const Entry* const entry = entries_.find(id);
  return entry ? entry->width_m : options_.least_m;
}

bool SoftWidths::wants_judging(std::uint32_t id) const noexcept {
  if (ablated(Mechanism::kSoftWidths)) return false;
  if (!(options_.most_stiffness_N_per_m > 0) || !(options_.least_m > 0)) return false;
  const Entry* const entry = entries_.find(id);
  return entry && (entry->width_m > options_.least_m || entry->most_likely_N_per_m > options_.most_stiffness_N_per_m);
}

void SoftWidths::judge(std::uint32_t id, double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                       const spatial::Matrix6& hessian, double arm_m) noexcept {
  Entry* const known = entries_.find(id);
  if (!known) return;
  Entry& entry = *known;
  const double most = options_.most_stiffness_N_per_m;
  const double whole = stiffness_bound_N_per_m(k_N_per_m, depth_m, gradient, hessian, arm_m);
  const double plain = std::min(k_N_per_m * with_arm(gradient, arm_m).squaredNorm(), whole);
  const double goal_m = entry.width_m * (whole - plain) / std::max(most - plain, kLeastShareHeld * most);
  const double dt_s = std::min(entry.since_judged_s, kLongAgo_s);
  entry.since_judged_s = 0;
  entry.softer_s = goal_m < kClearlySofter * entry.width_m ? entry.softer_s + dt_s : 0;
  const double narrowed_m = entry.width_m * std::exp(-entry.softer_s / options_.narrow_s);
  const double moved_m = goal_m > entry.width_m
                             ? std::min(goal_m, entry.width_m * std::exp(dt_s / options_.widen_s))
                             : std::min(entry.width_m, std::max(goal_m / kClearlySofter, narrowed_m));
  const double next_m = std::clamp(moved_m, options_.least_m, options_.most_m);
  if (std::abs(next_m - entry.width_m) <= kSameWidth * entry.width_m) return;
  entry.width_m = next_m;
  entry.softer_s = 0;
}

void SoftWidths::rename(std::uint32_t from, std::uint32_t to) noexcept {
  if (const Entry* const entry = entries_.find(from); entry && !entries_.find(to)) entries_.keep(to) = Entry{*entry};
}

void SoftWidths::begin_answer(double dt_s) noexcept {
  entries_.begin_answer();
  entries_.visit([dt_s](Entry& entry) { entry.since_judged_s += dt_s; });
}

void SoftWidths::note(std::uint32_t id, double k_N_per_m, double depth_m) noexcept {
  const bool is_new = entries_.find(id) == nullptr;
  Entry& entry = entries_.keep(id);
  if (is_new) entry = {.width_m = options_.least_m, .since_judged_s = kLongAgo_s};
  entry.most_likely_N_per_m = k_N_per_m * (1 + std::max(depth_m, 0.0) / options_.least_m);
}

}  // namespace farfeel::contact
