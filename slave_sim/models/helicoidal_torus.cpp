// A torus of n x m squares, 2 n m triangles: n = 400 round the ring (angle u), m = 160 round the tube (angle v).
// Wrinkles are cosines of k (v - 3 u): crests wind round the tube three times a turn of the ring. Along the surface
// their wave number is k sqrt(1/r^2 + 9/R^2), 1.27 k per radius r, so k = 18 gives a period of 4.94 mm at the ring's
// middle (3.9 mm on its inside, 5.6 mm on its outside).
#include <cmath>
#include <numbers>

#include "slave_sim/models/models.h"

namespace farfeel::slave_sim {
namespace {

constexpr std::uint32_t kRing = 400, kTube = 160;
constexpr double kRingRadius_m = 0.060, kTubeRadius_m = 0.020, kAmplitude_m = 0.0006;
constexpr int kTwists = 3, kWrinkles = 18;

}  // namespace

geometry::TriangleMesh helicoidal_torus_mesh() {
  geometry::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < kRing; ++i) {
    for (std::uint32_t j = 0; j < kTube; ++j) {
      const double u = 2 * std::numbers::pi * i / kRing, v = 2 * std::numbers::pi * j / kTube;
      const double r = kTubeRadius_m + kAmplitude_m * std::cos(kWrinkles * (v - kTwists * u));
      const double out = kRingRadius_m + r * std::cos(v);
      mesh.positions_O.emplace_back(out * std::cos(u), out * std::sin(u), r * std::sin(v));
    }
  }
  const auto at = [](std::uint32_t i, std::uint32_t j) { return i % kRing * kTube + j % kTube; };
  for (std::uint32_t i = 0; i < kRing; ++i) {
    for (std::uint32_t j = 0; j < kTube; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

}  // namespace farfeel::slave_sim
