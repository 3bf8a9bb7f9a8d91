// A T of two box-shaped arms on a lattice: the head along y, the handle along x, one layer of cells in z. Away from
// where they cross, each arm's square section |q|_max = r is bent into the circle |q| = r:
//   p = (1 - w) q + w q |q|_max / |q|,   w from 0 at the crossing to 1 beyond the fade.
#include <algorithm>
#include <cmath>

#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"
#include "slave_sim/models/roughness.h"

namespace farfeel::slave_sim {
namespace {

constexpr double kHeadHalf_m = 0.055, kNeck_m = 0.014, kHeadWidth_m = 0.016, kLength_m = 0.300;
constexpr glm::dvec3 kMiddle_m{0.134, 0, 0};  // of the bounding dimensions, with x = 0 at the head's middle

double smooth(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A point of an arm's section, in units of its half widths, and the outward direction of its walls there.
struct Section {
  glm::dvec2 q, wall;
};

Section bent(const glm::dvec2& q, const glm::dvec2& faces, double w) {
  const double length = glm::length(q), r = std::max(std::abs(q.x), std::abs(q.y));
  if (length == 0) return {q, faces};
  const bool is_wall = faces != glm::dvec2(0);
  return {q * (1 - w + w * r / length), is_wall ? (1 - w) * faces + w * q / length : glm::dvec2(0)};
}

}  // namespace

geometry::TriangleMesh hammer_mesh() {
  const SolidNoise bumps({.rms_m = 0.00015, .shortest_m = 0.002, .longest_m = 0.006});
  const LatticeSolid tee{.cuts_m = {{{-kHeadWidth_m, kHeadWidth_m, kLength_m - kHeadWidth_m},
                                     {-kHeadHalf_m, -kNeck_m, kNeck_m, kHeadHalf_m},
                                     {-1, 1}}},
                         .steps = {{{69, 571}, {91, 60, 91}, {65}}},
                         .is_solid = [](int i, int j, int) { return i == 0 || j == 1; }};
  return skin(tee, [&](const LatticePoint& at) {
    glm::dvec3 p = at.p, outward = at.outward();
    if (std::abs(p.y) > kNeck_m) {  // the head: slim behind its faces
      const double out = (std::abs(p.y) - kNeck_m) / (kHeadHalf_m - kNeck_m);
      const Section s = bent({p.x / kHeadWidth_m, p.z}, {outward.x, outward.z}, smooth(3 * out));
      const double half_m = kHeadWidth_m * (1 - 0.25 * smooth(2 * out) + 0.30 * smooth(2 * out - 1));
      p = {half_m * s.q.x, p.y, half_m * s.q.y};
      outward = {s.wall.x, outward.y, s.wall.y};
    } else {  // the handle, and the crossing: as wide as the neck, slimmer in its middle
      const double along = (p.x - kHeadWidth_m) / (kLength_m - 2 * kHeadWidth_m);
      const Section s = bent({p.y / kNeck_m, p.z}, {outward.y, outward.z}, smooth(8 * along));
      const double slim = 1 - 0.35 * smooth(4 * along) + 0.20 * smooth(2 * along - 1);
      const double across_m = kNeck_m * slim, up_m = kHeadWidth_m + (kNeck_m - kHeadWidth_m) * smooth(8 * along);
      p = {p.x, across_m * s.q.x, up_m * slim * s.q.y};
      outward = {outward.x, s.wall.x, s.wall.y};
    }
    return p - kMiddle_m + bumps.height_m(p) * outward;
  });
}

}  // namespace farfeel::slave_sim
