#include "haptic_core/motion/course.h"

#include <algorithm>
#include <cmath>

namespace farfeel::motion {

bool is_usable(const Course& course) noexcept {
  const bool is_way = course.takes_s >= kShortestCourse_s && course.takes_s <= kLongestCourse_s;
  return std::isfinite(course.from_s) && (is_way || course.takes_s == 0) && spatial::is_valid(course.X_from_WO) &&
         spatial::is_valid(course.X_to_WO);
}

Placement placement(const Course& course, double scene_s) noexcept {
  if (!(scene_s < course.from_s + course.takes_s)) return {course.X_to_WO, {}, course.is_there};
  const double x = std::clamp((scene_s - course.from_s) / course.takes_s, 0.0, 1.0);
  const double share = x * x * (3 - 2 * x), rate_1_per_s = 6 * x * (1 - x) / course.takes_s;
  const glm::dvec3 way_m = course.X_to_WO.p - course.X_from_WO.p,
                   turn_rad = spatial::vector_from_rotation(course.X_to_WO.R * glm::conjugate(course.X_from_WO.R));
  return {{glm::normalize(spatial::rotation_from_vector(share * turn_rad) * course.X_from_WO.R),
           course.X_from_WO.p + share * way_m},
          {rate_1_per_s * turn_rad, rate_1_per_s * way_m},
          course.is_there};
}

Course caught_up(const Course& course, const Placement& now, double now_s) noexcept {
  if (now_s <= course.from_s || !now.is_there || !course.is_there) return course;
  Course late = course;
  late.from_s = now_s;
  late.takes_s = std::max(course.from_s + course.takes_s - now_s, kCatchUp_s);
  late.X_from_WO = now.X_WO;
  return late;
}

Course at_rest(const spatial::Pose& X_WO, bool is_there) noexcept {
  return {.X_from_WO = X_WO, .X_to_WO = X_WO, .is_there = is_there};
}

}  // namespace farfeel::motion
