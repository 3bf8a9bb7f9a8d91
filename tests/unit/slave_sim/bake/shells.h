// Walls as surfaces of revolution: what convex pieces and coarse meshes have to keep apart.
#pragma once

#include <cmath>
#include <numbers>

#include "tests/support/solids.h"

namespace farfeel::slave_sim {

/// Part of a spherical shell about the z axis, open towards +z, to this angle from its lowest point.
inline geometry::TriangleMesh shell_mesh(double radius_m, double wall_m, double angle_rad, std::uint32_t steps,
                                         std::uint32_t sides) {
  constexpr double kLeast_rad = 0.05;  // of the flat fans at the axis
  return support::turned_mesh(
      {.sides = sides, .rows = 2 * (steps + 1), .is_ring = false, .profile = [=](std::uint32_t row, double) {
         const bool is_outer = row <= steps;
         const double along = static_cast<double>(is_outer ? row : 2 * steps + 1 - row) / steps;
         const double angle = kLeast_rad + along * (angle_rad - kLeast_rad),
                      r = is_outer ? radius_m : radius_m - wall_m;
         return support::ProfilePoint{r * std::sin(angle), -r * std::cos(angle)};
       }});
}

inline geometry::TriangleMesh bowl_mesh(double wall_m) {
  return shell_mesh(0.06, wall_m, 0.5 * std::numbers::pi, 8, 20);
}
inline geometry::TriangleMesh dish_mesh(double wall_m) {
  return shell_mesh(0.12, wall_m, 0.6, 7, 20);
}

inline geometry::TriangleMesh cup_mesh(double wall_m) {
  constexpr double kRadius_m = 0.035, kHeight_m = 0.08;
  return support::turned_mesh(
      {.sides = 24, .rows = 6, .is_ring = false, .profile = [=](std::uint32_t row, double) {
         const double inner = kRadius_m - wall_m;
         const std::array<support::ProfilePoint, 6> at{
             {{0.01, 0}, {kRadius_m, 0}, {kRadius_m, kHeight_m}, {inner, kHeight_m}, {inner, wall_m}, {0.01, wall_m}}};
         return at[row];
       }});
}

/// Two spherical caps that meet in a rim.
inline geometry::TriangleMesh lens_mesh(double radius_m, double thickness_m) {
  constexpr std::uint32_t kSteps = 8;
  const double half_m = 0.5 * thickness_m, R_m = (radius_m * radius_m + half_m * half_m) / (2 * half_m);
  return support::turned_mesh(
      {.sides = 24, .rows = 2 * kSteps + 1, .is_ring = false, .profile = [=](std::uint32_t row, double) {
         const double r =
             radius_m * (row <= kSteps ? 0.05 + 0.95 * row / kSteps : 0.05 + 0.95 * (2.0 * kSteps - row) / kSteps);
         const double z = half_m - R_m + std::sqrt(R_m * R_m - r * r);
         return support::ProfilePoint{r, row < kSteps ? -z : row == kSteps ? 0 : z};
       }});
}

}  // namespace farfeel::slave_sim
