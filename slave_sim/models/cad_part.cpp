// A lattice of 9 x 7 columns, each solid from the underside up to its own level or not at all. Around each round
// feature the squares |q|_max = r are bent into circles |q| = r, and the bend fades out within the ring a < r < b:
//   p = (1 - w(r)) q + w(r) q r / |q|,   w = 1 for r <= a, 0 for r >= b.
#include <array>
#include <cmath>
#include <numbers>

#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"
#include "slave_sim/models/roughness.h"

namespace farfeel::slave_sim {
namespace {

// Steps an interval: near 0.46 mm each, and exactly 658,432 triangles together.
const std::array<std::vector<double>, 3> kCuts_m{{{-.080, -.064, -.040, -.028, -.010, .010, .028, .040, .064, .080},
                                                  {-.060, -.046, -.022, -.010, .010, .022, .046, .060},
                                                  {-.030, -.022, -.018, -.005, .010, .015, .030}}};
const std::array<std::vector<std::uint32_t>, 3> kSteps{
    {{34, 52, 25, 39, 43, 39, 26, 51, 35}, {30, 51, 26, 44, 26, 52, 31}, {18, 8, 28, 33, 11, 32}}};

// How many of the six levels are filled, seen from above: columns along x, rows from y = -60 mm upwards.
constexpr std::array<std::array<int, 9>, 7> kLevels{{{3, 3, 3, 4, 4, 4, 3, 3, 3},    // rib
                                                     {3, 0, 3, 3, 3, 3, 3, 6, 3},    // through hole; boss
                                                     {3, 3, 3, 1, 1, 1, 3, 3, 3},    // pocket
                                                     {3, 3, 3, 1, 5, 1, 3, 3, 2},    // island in the pocket; step
                                                     {3, 3, 3, 1, 1, 1, 3, 3, 3},    // pocket
                                                     {3, 6, 3, 3, 3, 3, 3, 0, 3},    // boss; through hole
                                                     {3, 3, 3, 3, 0, 3, 3, 3, 3}}};  // notch

struct Round {
  double x_m, y_m, radius_m, fade_m;
};
constexpr std::array kRounds{Round{-.052, -.034, .012, .006}, Round{.052, .034, .012, .006},
                             Round{-.052, .034, .012, .006}, Round{.052, -.034, .012, .006}, Round{0, 0, .010, .005}};

/// Where a lattice point stands once the round features are round, and the outward direction of walls there.
struct Bent {
  glm::dvec3 p_m;
  glm::dvec3 wall{0};  ///< unit away from the axis on a round wall, zero elsewhere
};

Bent bend(const glm::dvec3& p_m) {
  for (const Round& round : kRounds) {
    const glm::dvec2 q(p_m.x - round.x_m, p_m.y - round.y_m);
    const double r = std::max(std::abs(q.x), std::abs(q.y)), length = glm::length(q);
    if (r >= round.radius_m + round.fade_m || r == 0) continue;
    const double t = std::max(0.0, (r - round.radius_m) / round.fade_m);
    const double w = (1 - t) * (1 - t) * (1 + 2 * t);
    const glm::dvec2 bent = q * (1 - w + w * r / length);
    Bent result{.p_m = {round.x_m + bent.x, round.y_m + bent.y, p_m.z}};
    if (std::abs(r - round.radius_m) < 1e-9) result.wall = glm::dvec3(q / length, 0);
    return result;
  }
  return {.p_m = p_m};
}

}  // namespace

geometry::TriangleMesh cad_part_mesh() {
  const SolidNoise noise({.rms_m = 0.00015, .shortest_m = 0.002, .longest_m = 0.006});
  const LatticeSolid part{
      .cuts_m = kCuts_m, .steps = kSteps, .is_solid = [](int i, int j, int k) { return k < kLevels[j][i]; }};
  return skin(part, [&](const LatticePoint& at) {
    const Bent bent = bend(at.p);
    glm::dvec3 outward = at.outward();
    if (bent.wall != glm::dvec3(0) && (outward.x != 0 || outward.y != 0)) {
      const bool is_hole = glm::dot(bent.wall, outward) < 0;
      outward = glm::dvec3(0, 0, outward.z) + (is_hole ? -bent.wall : bent.wall);
    }
    return bent.p_m + noise.height_m(bent.p_m) * outward;
  });
}

}  // namespace farfeel::slave_sim
