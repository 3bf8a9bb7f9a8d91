// Soft walls at the edges of a device's workspace, so that its joints do not meet their stops with force behind them.
#pragma once

#include <algorithm>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::devices {

/// A spring outwards of each edge, and a damper there for motion further out: both only take energy or give back what
/// they took. Realtime-safe.
struct WorkspaceWall {
  glm::dvec3 min_B_m{0}, max_B_m{0};  ///< the same along an axis: no wall there
  double stiffness_N_per_m = 0, damping_Ns_per_m = 0;

  [[nodiscard]] glm::dvec3 force_N(const glm::dvec3& p_BD, const glm::dvec3& v_BD) const noexcept {
    glm::dvec3 F{0};
    for (int axis = 0; axis < 3; ++axis) {
      if (!(max_B_m[axis] > min_B_m[axis])) continue;
      const double above = p_BD[axis] - max_B_m[axis], below = min_B_m[axis] - p_BD[axis];
      if (above > 0) F[axis] = -stiffness_N_per_m * above - damping_Ns_per_m * std::max(0.0, v_BD[axis]);
      if (below > 0) F[axis] = stiffness_N_per_m * below - damping_Ns_per_m * std::min(0.0, v_BD[axis]);
    }
    return F;
  }
};

}  // namespace farfeel::devices
