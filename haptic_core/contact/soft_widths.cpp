#include "haptic_core/contact/soft_widths.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace farfeel::contact {
namespace {

/// A new contact's width may be anything: nothing was felt before.
constexpr double kLongAgo_s = 1;
/// Widening cannot help below this share of what the loop holds: the rest is g g^T, which has no width.
constexpr double kLeastShare = 0.25;
/// Of a width: a change by less is not worth asking for the contact again.
constexpr double kSame = 0.01;

spatial::Vector6 with_arm(const spatial::Vector6& v, double arm_m) {
  spatial::Vector6 lengths = v;
  lengths.head<3>() /= arm_m;
  return lengths;
}

}  // namespace

double largest_stiffness_N_per_m(double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                                 const spatial::Matrix6& hessian, double arm_m) noexcept {
  spatial::Matrix6 lengths = hessian;
  lengths.topRows<3>() /= arm_m;
  lengths.leftCols<3>() /= arm_m;
  const spatial::Vector6 g = with_arm(gradient, arm_m);
  const spatial::Matrix6 stiffness = k_N_per_m * (g * g.transpose() + std::max(depth_m, 0.0) * lengths);
  if (!stiffness.allFinite()) return 0;
  const Eigen::SelfAdjointEigenSolver<spatial::Matrix6> solver(stiffness, Eigen::EigenvaluesOnly);
  return std::max(solver.eigenvalues()[5], 0.0);
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

std::uint32_t SoftWidths::next_to_judge() noexcept {
  if (!(options_.most_stiffness_N_per_m > 0) || !(options_.least_m > 0)) return 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    turn_ = (turn_ + 1) % count_;
    const Entry& entry = entries_[turn_];
    if (entry.width_m > options_.least_m || entry.most_likely_N_per_m > options_.most_stiffness_N_per_m)
      return entry.id;
  }
  return 0;
}

double SoftWidths::judge(std::uint32_t id, double k_N_per_m, double depth_m, const spatial::Vector6& gradient,
                         const spatial::Matrix6& hessian, double arm_m) noexcept {
  const std::uint32_t at = index_of(id);
  if (at == count_) return options_.least_m;
  Entry& entry = entries_[at];
  const double most = options_.most_stiffness_N_per_m;
  const double whole = largest_stiffness_N_per_m(k_N_per_m, depth_m, gradient, hessian, arm_m);
  const double plain = std::min(k_N_per_m * with_arm(gradient, arm_m).squaredNorm(), whole);
  const double goal_m = entry.width_m * (whole - plain) / std::max(most - plain, kLeastShare * most);
  const double dt_s = std::min(entry.since_judged_s, kLongAgo_s);
  entry.since_judged_s = 0;
  const double moved_m = std::clamp(goal_m, entry.width_m * std::exp(-dt_s / options_.narrow_s),
                                    entry.width_m * std::exp(dt_s / options_.widen_s));
  const double next_m = std::clamp(moved_m, options_.least_m, options_.most_m);
  if (std::abs(next_m - entry.width_m) > kSame * entry.width_m) entry.width_m = next_m;
  return entry.width_m;
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
