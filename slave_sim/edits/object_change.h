// What may be asked of an object that may change.
#pragma once

#include <cstdint>
#include <optional>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::slave_sim {

struct ObjectChange {
  std::uint32_t object = 0;                ///< index in the scene
  std::optional<spatial::Pose> X_WO = {};  ///< where it goes; none: it stays where it is then
  double takes_s = 0;                      ///< on the way there; what comes or goes is there, or gone, at once
  bool is_there = true;                    ///< afterwards
};

}  // namespace farfeel::slave_sim
