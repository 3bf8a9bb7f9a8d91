// What one source says of how deep a contact is: the coarse pieces, or points of the surface.
#pragma once

#include <glm/glm.hpp>
#include <limits>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// In S's frame.
struct DepthSource {
  double depth_m = -std::numeric_limits<double>::infinity();  ///< -infinity where it says nothing
  spatial::Vector6 gradient = spatial::Vector6::Zero();       ///< d depth / d (rotation, translation) of T about To
  glm::dvec3 p_S{0};                                          ///< the contact point
};

}  // namespace farfeel::contact
