#include "tests/support/solids.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "slave_sim/bake/convex_pieces.h"
#include "slave_sim/models/lattice_solid.h"

namespace farfeel::support {
namespace {

using geometry::TriangleMesh;

constexpr double kTurn = 2 * std::numbers::pi;

/// 1 at whole numbers, 0 half way between, straight in between.
double triangle_wave(double x) {
  return std::abs(2 * (x - std::floor(x)) - 1);
}

double thread_radius_m(const Thread& thread, double theta, double z_m) {
  return thread.radius_m + thread.depth_m * triangle_wave(z_m / thread.pitch_m - theta / kTurn);
}

}  // namespace

geometry::HapticSurface untextured(TriangleMesh mesh) {
  geometry::HapticSurface surface;
  surface.coarse = std::move(mesh);
  for (glm::dvec3& p : surface.coarse.positions_O) p = geometry::rounded_to_float(p);
  const slave_sim::ConvexPieces pieces = slave_sim::convex_pieces(surface.coarse, {.tolerance_m = 1e-6});
  surface.triangle_piece = pieces.triangle_piece;
  surface.piece_count = pieces.count;
  surface.triangle_chart.assign(surface.coarse.triangles.size(), geometry::kNoChart);
  return surface;
}

TriangleMesh box_mesh(const glm::dvec3& size_m) {
  const slave_sim::LatticeSolid box{.cuts_m = {{{-0.5, 0.5}, {-0.5, 0.5}, {-0.5, 0.5}}},
                                    .steps = {{{1}, {1}, {1}}},
                                    .is_solid = [](int, int, int) { return true; }};
  return slave_sim::skin(box, [&](const slave_sim::LatticePoint& at) { return at.p * size_m; });
}

TriangleMesh turned_mesh(const Turned& turned) {
  TriangleMesh mesh;
  const std::uint32_t n = turned.sides, m = turned.rows;
  for (std::uint32_t row = 0; row < m; ++row) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const double theta = kTurn * i / n;
      const ProfilePoint at = turned.profile(row, theta);
      mesh.positions_O.emplace_back(at.r_m * std::cos(theta), at.r_m * std::sin(theta), at.z_m);
    }
  }
  for (std::uint32_t row = 0; row + (turned.is_ring ? 0 : 1) < m; ++row) {
    const std::uint32_t above = (row + 1) % m;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t next = (i + 1) % n;
      mesh.triangles.push_back({row * n + i, row * n + next, above * n + next});
      mesh.triangles.push_back({row * n + i, above * n + next, above * n + i});
    }
  }
  if (turned.is_ring) return mesh;
  const auto bottom = static_cast<std::uint32_t>(mesh.positions_O.size()), top = bottom + 1;
  mesh.positions_O.emplace_back(0, 0, turned.profile(0, 0).z_m);
  mesh.positions_O.emplace_back(0, 0, turned.profile(m - 1, 0).z_m);
  for (std::uint32_t i = 0; i < n; ++i) {
    mesh.triangles.push_back({bottom, (i + 1) % n, i});
    mesh.triangles.push_back({top, (m - 1) * n + i, (m - 1) * n + (i + 1) % n});
  }
  return mesh;
}

TriangleMesh cylinder_mesh(double radius_m, double height_m, std::uint32_t sides) {
  return turned_mesh({sides, 2, false, [=](std::uint32_t row, double) {
                        return ProfilePoint{radius_m, (row - 0.5) * height_m};
                      }});
}

TriangleMesh bumpy_ball_mesh(const BumpyBall& ball) {
  return turned_mesh({ball.sides, ball.rows, false, [=](std::uint32_t row, double theta) {
                        const double phi = std::numbers::pi * (row + 0.5) / ball.rows;  // from the south pole
                        const glm::dvec3 n(std::sin(phi) * std::cos(theta), std::sin(phi) * std::sin(theta),
                                           -std::cos(phi));
                        const double bump = std::sin(30 * n.x) * std::sin(30 * n.y + 1) * std::cos(30 * n.z);
                        const double r_m = ball.radius_m + ball.bump_m * bump;
                        return ProfilePoint{r_m * std::sin(phi), -r_m * std::cos(phi)};
                      }});
}

TriangleMesh tube_mesh(double inner_m, double outer_m, double height_m, std::uint32_t sides) {
  return turned_mesh({sides, 4, true, [=](std::uint32_t row, double) {
                        const bool is_outer = row == 0 || row == 1, is_high = row == 1 || row == 2;
                        return ProfilePoint{is_outer ? outer_m : inner_m, (is_high ? 0.5 : -0.5) * height_m};
                      }});
}

TriangleMesh cone_mesh(double half_angle_rad, double height_m, std::uint32_t sides) {
  TriangleMesh mesh;
  const double radius_m = height_m * std::tan(half_angle_rad);
  for (std::uint32_t i = 0; i < sides; ++i) {
    mesh.positions_O.emplace_back(radius_m * std::cos(kTurn * i / sides), radius_m * std::sin(kTurn * i / sides),
                                  height_m);
  }
  mesh.positions_O.emplace_back(0, 0, 0);
  mesh.positions_O.emplace_back(0, 0, height_m);
  for (std::uint32_t i = 0; i < sides; ++i) {
    mesh.triangles.push_back({sides, (i + 1) % sides, i});
    mesh.triangles.push_back({sides + 1, i, (i + 1) % sides});
  }
  return mesh;
}

TriangleMesh bolt_mesh(const Thread& thread) {
  const std::uint32_t rows = thread.turns * thread.steps + 1;
  return turned_mesh({thread.sides, rows, false, [=](std::uint32_t row, double theta) {
                        const double z_m =
                            (static_cast<double>(row) / thread.steps - 0.5 * thread.turns) * thread.pitch_m;
                        return ProfilePoint{thread_radius_m(thread, theta, z_m), z_m};
                      }});
}

TriangleMesh nut_mesh(const Thread& thread, double clearance_m, std::uint32_t turns) {
  const std::uint32_t inner = turns * thread.steps + 1;
  const double outer_m = thread.radius_m + 4 * thread.depth_m;
  return turned_mesh({thread.sides, inner + 2, true, [=](std::uint32_t row, double theta) {
                        const double half_m = 0.5 * turns * thread.pitch_m;
                        if (row == 0) return ProfilePoint{outer_m, -half_m};
                        if (row == 1) return ProfilePoint{outer_m, half_m};
                        const double z_m = half_m - (row - 2.0) * thread.pitch_m / thread.steps;
                        return ProfilePoint{thread_radius_m(thread, theta, z_m) + clearance_m, z_m};
                      }});
}

TriangleMesh spur_mesh(std::uint32_t teeth, double radius_m, double depth_m, double height_m) {
  return turned_mesh({2 * teeth, 2, false, [=](std::uint32_t row, double theta) {
                        const double r_m = radius_m + depth_m * triangle_wave(theta * teeth / kTurn);
                        return ProfilePoint{r_m, (row - 0.5) * height_m};
                      }});
}

}  // namespace farfeel::support
