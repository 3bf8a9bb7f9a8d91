// Where a device stands in the world: before what is explored, wherever a part's file or a scene puts that.
#pragma once

#include "codecs/scene/exploration.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::master_station {

/// The device's base in the world, with the world's axes, so that the middle of the region is where the middle of the
/// handle's workspace is. In metres of the handle: the tool is at workspace_scale (> 0) times X_WB * X_BD.
[[nodiscard]] spatial::Pose X_WB_before(const codecs::Exploration&, const glm::dvec3& p_BMiddle_B,
                                        double workspace_scale);

}  // namespace farfeel::master_station
