// What is felt of a scene but for its heights: what an operator's end is told once, before any tile.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "haptic_core/contact/material.h"
#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/motion/scripted_motion.h"
#include "haptic_core/penetration/felt_surface.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact_service {

struct FeltBody {
  geometry::HapticSurface surface;  ///< all its tiles are there, with heights that stand in for the true ones
  penetration::HeightLimits limits;
  contact::Material material;
  spatial::Pose X_WO;                                 ///< of a scene object
  std::optional<motion::ScriptedMotion> motion = {};  ///< of one; none: it stands still
  bool may_change = false, is_there = true;           ///< of one: as in contact::TouchableObject
  std::vector<double> off_m = {};  ///< one a tile: no height is farther from what stands in; empty: nobody knows
};

struct FeltScene {
  std::vector<FeltBody> bodies;  ///< the tool, then the scene's objects in their order; empty: nothing is told
  double tolerance_m = 0.005;    ///< as in ContactOptions, so that both ends find the same contacts
  std::uint32_t grid_samples = 50;
  double soft_width_m = 10e-6;
};

}  // namespace farfeel::contact_service
