// The skin of a box on a 731 x 80 x 16 lattice, 285,824 triangles, bent to the blade and raised by the cut.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"

namespace farfeel::slave_sim {
namespace {

constexpr glm::dvec3 kHalf_m{0.100, 0.0125, 0.003};  // over the crests, at the heel
constexpr double kPeriod_m = 0.0015, kDepth_m = 0.0003;

double ridge(double along_m) {  // 0 in a valley, 1 on a crest
  return 0.5 + 0.5 * std::cos(2 * std::numbers::pi * along_m / kPeriod_m);
}

}  // namespace

geometry::TriangleMesh file_mesh() {
  const LatticeSolid box{.cuts_m = {{{-1, 1}, {-1, 1}, {-1, 1}}},
                         .steps = {{{731}, {80}, {16}}},
                         .is_solid = [](int, int, int) { return true; }};
  return skin(box, [](const LatticePoint& at) {
    const double to_tip = 0.5 + 0.5 * at.p.x;  // 0 at the heel, 1 at the tip
    const double half_width_m = (kHalf_m.y - kDepth_m) * (1 - 0.35 * to_tip * to_tip);
    const double half_thickness_m = (kHalf_m.z - kDepth_m) * (1 - 0.4 * to_tip * to_tip) * (1 - 0.12 * at.p.y * at.p.y);
    const glm::dvec3 p_m(kHalf_m.x * at.p.x, half_width_m * at.p.y, half_thickness_m * at.p.z);

    // Across a face's border the cut keeps its height, so that the narrow faces' teeth meet the large ones'.
    const double u_m = (p_m.x + p_m.y) * std::numbers::sqrt2 / 2, v_m = (p_m.x - p_m.y) * std::numbers::sqrt2 / 2;
    const double crossed_m = 0.5 * kDepth_m * (ridge(u_m) + ridge(v_m));
    const double edge_m = std::clamp(4 * (std::abs(at.p.z) - 0.75), 0.0, 1.0);
    const double single_m = kDepth_m * ridge(p_m.x);
    const double side_m = edge_m * crossed_m + (1 - edge_m) * single_m;
    return p_m + glm::dvec3(0, side_m * at.outward().y, crossed_m * at.outward().z);
  });
}

}  // namespace farfeel::slave_sim
