#include "haptic_core/contact/depth/soft_widths.h"

#include <Eigen/Eigenvalues>
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

double largest_stiffness_N_per_m(double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                                 const spatial::Matrix6& hessian, double arm_m) noexcept {
  const spatial::Matrix6 stiffness = stiffness_with_arm(k_N_per_m, depth_m, gradient, hessian, arm_m);
  if (!stiffness.allFinite()) return 0;
  const Eigen::SelfAdjointEigenSolver<spatial::Matrix6> solver(stiffness, Eigen::EigenvaluesOnly);
  return std::max(solver.eigenvalues()[5], 0.0);
}

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

std::uint32_t SoftWidths::index_of(std::uint32_t id) const noexcept {
  const auto at =
      std::find_if(entries_.begin(), entries_.begin() + count_, [id](const Entry& entry) { return entry.id == id; });
  return static_cast<std::uint32_t>(at - entries_.begin());
}

double SoftWidths::width_m(std::uint32_t id) const noexcept {
  const std::uint32_t at = index_of(id);
  return at == count_ ? options_.least_m : entries_[at].width_m;
}

bool SoftWidths::wants_judging(std::uint32_t id) const noexcept {
  if (ablated(Mechanism::kSoftWidths)) return false;
  if (!(options_.most_stiffness_N_per_m > 0) || !(options_.least_m > 0)) return false;
  const std::uint32_t at = index_of(id);
  return at < count_ && (entries_[at].width_m > options_.least_m ||
                         entries_[at].most_likely_N_per_m > options_.most_stiffness_N_per_m);
}

void SoftWidths::judge(std::uint32_t id, double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                       const spatial::Matrix6& hessian, double arm_m) noexcept {
  const std::uint32_t at = index_of(id);
  if (at == count_) return;
  Entry& entry = entries_[at];
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
  const std::uint32_t at = index_of(from);
  if (at < count_ && index_of(to) == count_) entries_[at].id = to;
}

void SoftWidths::begin_answer(double dt_s) noexcept {
  for (std::uint32_t i = 0; i < count_; ++i) entries_[i].since_judged_s += dt_s, entries_[i].is_noted = false;
}

void SoftWidths::note(std::uint32_t id, double k_N_per_m, double depth_m) noexcept {
  const std::uint32_t at = index_of(id);
  if (at == count_) {
    if (count_ == entries_.size()) return;
    entries_[count_++] = {.id = id, .width_m = options_.least_m, .since_judged_s = kLongAgo_s};
  }
  entries_[at].is_noted = true;
  entries_[at].most_likely_N_per_m = k_N_per_m * (1 + std::max(depth_m, 0.0) / options_.least_m);
}

void SoftWidths::end_answer() noexcept {
  const auto end =
      std::remove_if(entries_.begin(), entries_.begin() + count_, [](const Entry& entry) { return !entry.is_noted; });
  count_ = static_cast<std::uint32_t>(end - entries_.begin());
}

}  // namespace farfeel::contact
