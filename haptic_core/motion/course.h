// What an object does from a scene time on, told once: it is there or not, and it goes from one pose to another.
//
// Both ends of a link hold the same courses, which begin at the same scene time, so that the object is at the same
// place at both whatever the delay. A course is absolute: it says where the way begins and where it ends, so that a
// newer one replaces an older one whether that was heard or not. Between its two poses the object starts and ends at
// rest and never goes back or beyond: with x = (scene time - from_s) / takes_s in [0, 1],
//   p = p_from + x^2 (3 - 2 x) (p_to - p_from),
// and its turn goes by the same share of the shorter way round.
#pragma once

#include <cstdint>

#include "haptic_core/motion/scripted_motion.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::motion {

struct Course {
  std::uint32_t version = 0;  ///< of one object; a newer one is larger
  double from_s = 0;          ///< scene time; before it, what was before holds
  double takes_s = 0;         ///< >= 0; 0: it is at X_to_WO at once
  spatial::Pose X_from_WO = {}, X_to_WO = {};
  bool is_there = true;  ///< else nothing touches it, and nothing shows it
};

inline constexpr double kShortestCourse_s = 1e-3, kLongestCourse_s = 3600;

/// Of numbers from anybody: times are finite, takes_s is 0 or from kShortestCourse_s to kLongestCourse_s, poses are
/// valid.
[[nodiscard]] bool is_usable(const Course&) noexcept;

/// At a scene time from from_s on. Realtime-safe.
[[nodiscard]] Placement placement(const Course&, double scene_s) noexcept;

/// What to do about a course that was told too late, when it had begun already: the object goes from where it is to
/// where the course ends, and is there when that ends, or kCatchUp_s from now. It makes no jump; until then it is not
/// where the other end has it. What comes or goes does so at once.
inline constexpr double kCatchUp_s = 0.2;
[[nodiscard]] Course caught_up(const Course&, const Placement& now, double now_s) noexcept;

/// The course of an object that has come to its end, or that nothing ever moved: it is there, or not, and rests.
[[nodiscard]] Course at_rest(const spatial::Pose& X_WO, bool is_there) noexcept;

}  // namespace farfeel::motion
