#include "haptic_core/local_model/kept_tangents.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"

namespace farfeel::local_model {
namespace {

double apart_m(const Tangent& a, const Tangent& b) {
  return glm::distance(a.p_TC_T(), b.p_TC_T());
}

/// Both speak of one place: from a, share 0, to b, share 1.
Tangent between(const Tangent& a, const Tangent& b, double share) {
  Tangent mean = b;
  mean.X0_WT = {glm::normalize(glm::slerp(a.X0_WT.R, b.X0_WT.R, share)), glm::mix(a.X0_WT.p, b.X0_WT.p, share)};
  mean.p_WC_W = glm::mix(a.p_WC_W, b.p_WC_W, share);
  mean.nhat_W = glm::normalize(glm::mix(a.nhat_W, b.nhat_W, share));
  mean.slope_W = glm::mix(a.slope_W, b.slope_W, share);
  mean.couple_W = glm::mix(a.couple_W, b.couple_W, share);
  mean.depth_m = glm::mix(a.depth_m, b.depth_m, share);
  return mean;
}

bool is_one_place(const Tangent& a, const Tangent& b) {
  return apart_m(a, b) < kSameSpot_m;
}

bool is_one_flank(const Tangent& a, const Tangent& b) {
  return glm::distance(a.slope_W - a.nhat_W, b.slope_W - b.nhat_W) < kOtherFlank;
}

}  // namespace

/// Of the newest, and of those that are kept.
struct KeptTangents::Weights {
  double depth_m = 0;
  double newest = 1;
  std::array<double, kMostKept> kept{};
  std::array<Tangent::At, kMostKept> at;  // of those that speak
};

KeptTangents::Weights KeptTangents::weights(const Tangent::At& newest, const spatial::Pose& X_WT) const noexcept {
  Weights w;
  double top_m = newest.depth_m;
  for (std::size_t i = 0; i < count_; ++i) {
    if (!speaks_[i]) continue;
    w.at[i] = all_[i].at(X_WT);
    top_m = std::max(top_m, w.at[i].depth_m);
  }
  double sum = w.newest = std::exp((newest.depth_m - top_m) / kKeptWidth_m);
  for (std::size_t i = 0; i < count_; ++i)
    if (speaks_[i]) sum += w.kept[i] = std::exp((w.at[i].depth_m - top_m) / kKeptWidth_m);
  w.newest /= sum;
  for (double& kept : w.kept) kept /= sum;
  w.depth_m = top_m + kKeptWidth_m * std::log(sum) - excess_m_;
  return w;
}

void KeptTangents::join(Tangent::At& newest, const spatial::Pose& X_WT) const noexcept {
  const Weights w = weights(newest, X_WT);
  newest.depth_m = w.depth_m;
  newest.gradient *= w.newest;
  newest.p_ToC_W *= w.newest;
  for (std::size_t i = 0; i < count_; ++i) {
    if (!(w.kept[i] > 0)) continue;
    newest.gradient += w.kept[i] * w.at[i].gradient;
    newest.p_ToC_W += w.kept[i] * w.at[i].p_ToC_W;
  }
}

spatial::Matrix6 KeptTangents::bend_at(const Tangent::At& newest, const spatial::Pose& X_WT) const noexcept {
  const Weights w = weights(newest, X_WT);
  spatial::Vector6 mean = w.newest * newest.gradient;
  for (std::size_t i = 0; i < count_; ++i)
    if (w.kept[i] > 0) mean += w.kept[i] * w.at[i].gradient;
  const auto spread = [&](double weight, const spatial::Vector6& gradient) -> spatial::Matrix6 {
    const spatial::Vector6 off = gradient - mean;
    return weight / kKeptWidth_m * off * off.transpose();
  };
  spatial::Matrix6 bend = spread(w.newest, newest.gradient);
  for (std::size_t i = 0; i < count_; ++i)
    if (w.kept[i] > 0) bend += spread(w.kept[i], w.at[i].gradient);
  return bend;
}

/// Where there is no room the one goes that stands closest among the others: ends and corners say most.
void KeptTangents::add(const Tangent& tangent) noexcept {
  if (count_ < kMostKept) {
    all_[count_++] = tangent;
    return;
  }
  std::array<Tangent, kMostKept + 1> candidates;
  std::copy(all_.begin(), all_.end(), candidates.begin());
  candidates[kMostKept] = tangent;
  std::size_t least = 0;
  double least_m = 0;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    std::array<double, 2> nearest_m{1e9, 1e9};
    for (std::size_t j = 0; j < candidates.size(); ++j) {
      if (i == j) continue;
      const double m = apart_m(candidates[i], candidates[j]);
      if (m < nearest_m[0])
        nearest_m = {m, nearest_m[0]};
      else if (m < nearest_m[1])
        nearest_m[1] = m;
    }
    const double sum_m = nearest_m[0] + nearest_m[1];
    if (i == 0 || sum_m < least_m) least = i, least_m = sum_m;
  }
  if (least < kMostKept) all_[least] = tangent;
}

void KeptTangents::keep(const Tangent& before, const Tangent& now, bool is_late) noexcept {
  if (ablated(Mechanism::kKeptTangents)) return;
  is_late = is_late && !ablated(Mechanism::kOtherFlanks);
  Tangent candidate = before;
  candidate.range_m = std::min(before.range_m, kKeptRange_m);
  candidate.fall = kFall;
  bool is_known = false;
  for (std::size_t i = 0; i < count_; ++i) {
    Tangent& old = all_[i];
    if (!is_one_place(old, candidate) || (is_late && !is_one_flank(old, candidate))) continue;
    is_known = true;
    // It stays until the tool leaves it, and then comes along as far as it must (a play operator): one that followed at
    // once would forget the place that it came from, and one that was told anew all at once would be another as
    // rounding has it.
    const double left = glm::length(old.at(now.X0_WT).moved_W) / (kStaysWithin * old.range_m);
    const double says_more = (candidate.at(old.X0_WT).depth_m - old.depth_m) / kSaysMore_m;
    const double stale = std::max(left, says_more);
    if (stale > 1) old = between(old, candidate, 1 - 1 / stale);
  }
  if (!is_known) add(candidate);

  std::size_t kept = 0;
  double sum = 1;
  for (std::size_t i = 0; i < count_; ++i) {
    Tangent old = all_[i];
    const bool is_here = is_one_place(old, now), is_other_flank = is_late && is_here && !is_one_flank(old, now);
    const bool is_climbed = is_late && glm::length(old.slope_W) > kSteep;
    const double cautious_m = std::min(now.range_m, kKeptRange_m);
    old.range_m = is_climbed ? now.range_m : cautious_m;
    double over_m = old.at(now.X0_WT).depth_m - now.depth_m;
    // Where either says more of the other's pose than was said there, there is no groove between them but a crest.
    if (is_here && (is_climbed || is_other_flank) && over_m > kSaysMore_m) continue;
    if (is_other_flank && now.at(old.X0_WT).depth_m > old.depth_m + kSaysMore_m) continue;
    if (is_climbed && over_m > 0) {
      old.range_m = cautious_m;
      over_m = old.at(now.X0_WT).depth_m - now.depth_m;
    }
    if (over_m < -kTooLow_m || glm::dot(old.nhat_W, now.nhat_W) < kSameSideCosine) continue;
    if (over_m > 0) old.depth_m -= over_m;  // what is said now is the truth
    speaks_[kept] = !is_here || is_other_flank;
    if (speaks_[kept]) sum += std::exp(std::min(over_m, 0.0) / kKeptWidth_m);
    all_[kept++] = old;
  }
  count_ = kept;
  excess_m_ = kKeptWidth_m * std::log(sum);
}

void KeptTangents::go_along(const spatial::Pose& way_W) noexcept {
  for (std::size_t i = 0; i < count_; ++i) all_[i].go_along(way_W);
}

}  // namespace farfeel::local_model
