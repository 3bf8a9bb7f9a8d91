#include "slave_sim/bake/displacement.h"

namespace farfeel::slave_sim {

BakedChart baked_chart(const geometry::TriangleMesh& coarse, const ChartPlan& plan, double texel_m,
                       const FullSurface& full, double reach_m, int rays_across) {
  const glm::dvec3 z_O = spatial::rotate(plan.X_OH, {0, 0, 1});
  const auto height = [&](const glm::dvec2& at_m, double near_m, double within_m) {
    return full.height_along(spatial::transform_point(plan.X_OH, glm::dvec3(at_m, near_m)), z_O, within_m);
  };
  const geometry::Chart chart{
      .X_OH = plan.X_OH, .texel_m = texel_m, .columns = plan.columns, .rows = plan.rows, .first_tile = 0};
  return codecs::chart_heights(coarse, plan.triangles, chart, height, reach_m, rays_across);
}

}  // namespace farfeel::slave_sim
