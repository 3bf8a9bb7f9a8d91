// What a simulated operator knows of a scene: which part of the tool to bring where, and how hard to press.
#pragma once

#include <glm/glm.hpp>

namespace farfeel::codecs {

struct Exploration {
  glm::dvec3 p_TWork_T{0};                       ///< point of the tool that is brought to the surface [m]
  glm::dvec3 nhat_work_T{0, 0, -1};              ///< unit, outward normal of the tool's working face there
  glm::dvec3 region_low_W{0}, region_high_W{0};  ///< box in which that point strokes [m]
  glm::dvec3 approach_W{0, 0, -1};               ///< unit, towards the surface
  double press_force_N = 3;                      ///< > 0
  double stroke_speed_m_per_s = 0.1;             ///< > 0
};

}  // namespace farfeel::codecs
