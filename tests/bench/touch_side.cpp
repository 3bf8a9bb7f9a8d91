#include "tests/bench/touch_side.h"

#include <algorithm>

namespace farfeel::bench {
namespace {

// Each way begins so much before the last one's end: float may have missed what lies there.
constexpr double kBackwards_m = 1e-6;

}  // namespace

TrueTouch SideWatch::move_to(const glm::dvec3& p_O, double radius_m) {
  const glm::dvec3 way = p_O - last_O_;
  const double length_m = glm::length(way);
  if (length_m > 0) {
    const glm::dvec3 ahead = way / length_m;
    glm::dvec3 from = last_O_ - kBackwards_m * ahead;
    constexpr int kMostCrossings = 16;
    for (int i = 0; i < kMostCrossings; ++i) {
      const auto crossing = truth_.first_crossing(from, p_O);
      if (!crossing) break;
      const bool is_inwards = glm::dot(crossing->nhat_O, ahead) < 0;
      if (!is_behind_ && is_inwards) is_behind_ = true, out_O_ = crossing->nhat_O;
      if (is_behind_ && !is_inwards && glm::dot(crossing->nhat_O, out_O_) > kAsideCosine) is_behind_ = false;
      from += crossing->share * (p_O - from) + 0.1 * kBackwards_m * ahead;
      if (glm::dot(p_O - from, ahead) <= 0) break;
    }
  }
  last_O_ = p_O;
  if (is_behind_) {
    const TrueTouch touch = truth_.behind(p_O, radius_m, out_O_);
    // Carried along a bent wall.
    if (const auto front = truth_.nearest_in_front(p_O, out_O_)) out_O_ = front->nhat_O;
    return touch;
  }
  const TouchTruth::Nearest found = truth_.nearest(p_O);
  return {.main = {radius_m - found.distance_m,
                   found.distance_m > 0 ? (p_O - found.q_O) / found.distance_m : found.nhat_O}};
}

double pushed_back_share(const TrueTouch& touch, const glm::dvec3& force_N, double stiffness_N_per_m, double most_N) {
  const auto share = [&](const WayOut& way) {
    return glm::dot(force_N, way.out_O) / std::min(stiffness_N_per_m * way.depth_m, most_N);
  };
  return touch.aside ? std::max(share(touch.main), share(*touch.aside)) : share(touch.main);
}

}  // namespace farfeel::bench
