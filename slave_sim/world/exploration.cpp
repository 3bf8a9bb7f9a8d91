#include "slave_sim/world/exploration.h"

namespace farfeel::slave_sim {

codecs::Exploration exploration_from_above(const codecs::Asset& object, const spatial::Pose& X_WO,
                                           const codecs::Asset& tool) {
  geometry::Box object_W;
  glm::dvec3 highest_W(0, 0, -std::numeric_limits<double>::infinity());
  for (const glm::dvec3& p_O : object.felt.coarse.positions_O) {
    const glm::dvec3 p_W = spatial::transform_point(X_WO, p_O);
    object_W.include(p_W);
    if (p_W.z > highest_W.z) highest_W = p_W;
  }
  glm::dvec3 lowest_T(0, 0, std::numeric_limits<double>::infinity());
  for (const glm::dvec3& p_T : tool.felt.coarse.positions_O) {
    if (p_T.z < lowest_T.z) lowest_T = p_T;
  }
  constexpr double kShareOfWidth = 0.05;  // to either side
  const glm::dvec3 half = kShareOfWidth * object_W.size();
  codecs::Exploration exploration;
  exploration.p_TWork_T = lowest_T;
  exploration.region_low_W = highest_W - glm::dvec3(half.x, half.y, 0);
  exploration.region_high_W = highest_W + glm::dvec3(half.x, half.y, 0);
  return exploration;
}

}  // namespace farfeel::slave_sim
