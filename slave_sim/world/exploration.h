// Where an operator would touch a scene that does not say: the tool's underside on a broad, level place on top of the
// first object.
#pragma once

#include "codecs/asset/asset.h"
#include "codecs/scene/exploration.h"

namespace farfeel::slave_sim {

/// Along -z of the world, with the tool's axes parallel to the world's. The region lies about the place from whose
/// surroundings, a tenth of the object's width, most faces up without a step. Precondition: both assets have coarse
/// triangles.
[[nodiscard]] codecs::Exploration exploration_from_above(const codecs::Asset& object, const spatial::Pose& X_WO,
                                                         const codecs::Asset& tool);

}  // namespace farfeel::slave_sim
