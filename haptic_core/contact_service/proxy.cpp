// Row i allows the proxy a way v with n_i . v <= allowed_i, n_i the translational part of its gradient. Where the tool
// turns or an object moves, allowed_i falls by what that adds to the depth. Its place p is the point nearest to the
// tool's that all rows allow,
//   p = p_WT - sum l_i n_i,   l_i >= 0,
// found by Hildreth's rounds: each l_i in turn takes up what its row is over.
#include "haptic_core/contact_service/proxy.h"

#include <algorithm>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact_service/constants.h"

namespace farfeel::contact_service {
namespace {

using glm::dot;
using glm::dvec3;

}  // namespace

void Proxy::note(const contact::Contact& at_proxy, double allowed_m) noexcept {
  if (count_ == rows_.size()) return;
  rows_[count_++] = {at_proxy.gradient, allowed_m, at_proxy.object};
}

void Proxy::set_out(const spatial::Pose& X_WT, double dt_s, const motion::MovingObjects& moving) noexcept {
  if (!has_place_ || ablated(Mechanism::kProxy) || glm::distance(X_WT.p, X_WT_.p) > kLongestWay_m) {
    X_WP_ = X_WT_ = X_WT;
    has_place_ = true;
    count_ = 0;
    way_left_m_ = 0;
    return;
  }
  const dvec3 turn = spatial::vector_from_rotation(X_WT.R * glm::conjugate(X_WP_.R));
  double object_way_m = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const spatial::Wrench g = spatial::wrench_from(rows_[i].gradient);
    rows_[i].allowed_m -= dot(g.torque_Nm, turn);
    if (const motion::Moved* moved = moving.find(rows_[i].object)) {
      const dvec3 object_way = spatial::transform_point(moved->way_W, X_WP_.p) - X_WP_.p;
      object_way_m = std::max(object_way_m, glm::length(object_way));
      rows_[i].allowed_m +=
          dot(g.force_N, object_way) + dot(g.torque_Nm, spatial::vector_from_rotation(moved->way_W.R));
    }
  }
  way_left_m_ =
      glm::distance(X_WT.p, X_WT_.p) + kLongestTool_m * glm::length(turn) + object_way_m + kCatchUp_m_per_s * dt_s;
  X_WP_.R = X_WT.R;
  X_WT_ = X_WT;
}

dvec3 Proxy::nearest_allowed() const noexcept {
  const dvec3 way = X_WT_.p - X_WP_.p;
  std::array<dvec3, contact::kMaxContacts> n;
  std::array<double, contact::kMaxContacts> push{};
  bool is_any_over = false;
  for (std::uint32_t i = 0; i < count_; ++i) {
    n[i] = spatial::wrench_from(rows_[i].gradient).force_N;
    is_any_over |= dot(n[i], way) > rows_[i].allowed_m && dot(n[i], n[i]) > kLeastSlope2;
  }
  if (!is_any_over) return X_WT_.p;
  dvec3 allowed_way = way;
  for (int round = 0; round < kRounds; ++round) {
    double most_over_m = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      const double slope2 = dot(n[i], n[i]);
      if (!(slope2 > kLeastSlope2)) continue;
      const double over_m = dot(n[i], allowed_way) - rows_[i].allowed_m;
      const double change = std::max(-push[i], over_m / slope2);
      push[i] += change;
      allowed_way -= change * n[i];
      most_over_m = std::max(most_over_m, over_m);
    }
    if (most_over_m < kAllowed_m) break;
  }
  return X_WP_.p + allowed_way;
}

bool Proxy::go_on(double reach_m) noexcept {
  const dvec3 place = nearest_allowed();
  const dvec3 step = place - X_WP_.p;
  const double length_m = glm::length(step), most_m = std::min(way_left_m_, reach_m);
  if (length_m <= most_m) {
    X_WP_.p = place;  // the tool's very place where nothing holds it back
    return false;
  }
  const bool may_go_on = reach_m < way_left_m_;
  X_WP_.p += step * (most_m / length_m);
  way_left_m_ -= most_m;
  return may_go_on;
}

contact::Contact Proxy::drawn_on(contact::Contact at_proxy) const noexcept {
  at_proxy.depth_m += dot(spatial::wrench_from(at_proxy.gradient).force_N, p_PT_W());
  return at_proxy;
}

}  // namespace farfeel::contact_service
