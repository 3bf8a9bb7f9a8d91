#include "tests/bench/touch_side.h"

namespace farfeel::bench {
namespace {

// Each way begins so much before the last one's end: float may have missed what lies there.
constexpr double kBackwards_m = 1e-6;

}  // namespace

WayOut SideWatch::move_to(const glm::dvec3& p_O, double radius_m) {
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
      if (is_behind_ && !is_inwards && glm::dot(crossing->nhat_O, out_O_) > 0) is_behind_ = false;
      from += crossing->share * (p_O - from) + 0.1 * kBackwards_m * ahead;
      if (glm::dot(p_O - from, ahead) <= 0) break;
    }
  }
  last_O_ = p_O;
  if (is_behind_) {
    if (const auto front = truth_.nearest_in_front(p_O, out_O_)) {
      out_O_ = front->nhat_O;
      return {radius_m + front->distance_m,
              front->distance_m > 0 ? (front->q_O - p_O) / front->distance_m : front->nhat_O};
    }
  }
  const TouchTruth::Nearest found = truth_.nearest(p_O);
  return {radius_m - found.distance_m, found.distance_m > 0 ? (p_O - found.q_O) / found.distance_m : found.nhat_O};
}

}  // namespace farfeel::bench
