// The tool is at s (p_WB + p_BD), s the workspace scale: with the handle in its middle it is in the region's.
#include "master_station/devices/place.h"

namespace farfeel::master_station {

spatial::Pose X_WB_before(const codecs::Exploration& exploration, const glm::dvec3& p_BMiddle_B,
                          double workspace_scale) {
  const glm::dvec3 p_WMiddle_W = 0.5 * (exploration.region_low_W + exploration.region_high_W);
  return {{1, 0, 0, 0}, p_WMiddle_W / workspace_scale - p_BMiddle_B};
}

}  // namespace farfeel::master_station
