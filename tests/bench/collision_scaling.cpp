#include "tests/bench/collision_scaling.h"

#include <cmath>

#include "tests/bench/collision_run.h"

namespace farfeel::bench {
namespace {

using glm::dvec3;

// A sphere of flat quadrilaterals (triangles at the poles), all one piece or each its own.
geometry::HapticSurface sphere(double radius_m, int columns, int rows, bool is_one_piece) {
  geometry::HapticSurface surface;
  auto& mesh = surface.coarse;
  mesh.positions_O.emplace_back(0, 0, -radius_m);
  for (int j = 1; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double a = 2 * M_PI * i / columns, b = M_PI * j / rows;
      mesh.positions_O.push_back(
          dvec3(glm::vec3(radius_m * dvec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), -std::cos(b)))));
    }
  }
  mesh.positions_O.emplace_back(0, 0, radius_m);
  const auto at = [&](int i, int j) { return std::uint32_t(1 + (j - 1) * columns + i % columns); };
  const auto last = std::uint32_t(mesh.positions_O.size() - 1);
  const auto add = [&](std::initializer_list<geometry::Triangle> triangles) {
    for (const auto& t : triangles) {
      mesh.triangles.push_back(t);
      surface.triangle_piece.push_back(is_one_piece ? 0 : surface.piece_count);
    }
    surface.piece_count = is_one_piece ? 1 : surface.piece_count + 1;
  };
  for (int i = 0; i < columns; ++i) {
    add({{0, at(i + 1, 1), at(i, 1)}});
    add({{last, at(i, rows - 1), at(i + 1, rows - 1)}});
    for (int j = 1; j + 1 < rows; ++j) {
      add({{at(i, j), at(i + 1, j), at(i + 1, j + 1)}, {at(i, j), at(i + 1, j + 1), at(i, j + 1)}});
    }
  }
  return surface;
}

std::vector<spatial::Pose> rolling(double distance_m, double depth_m) {
  std::vector<spatial::Pose> motion;
  for (int i = 0; i < 300; ++i) {
    const double a = 0.002 * i;
    motion.push_back(
        {spatial::rotation_from_vector({0.5 * a, a, 0.3}),
         (distance_m - depth_m * std::sin(20 * a)) * dvec3(std::sin(a), 0.3, std::cos(a)) / std::sqrt(1.09)});
  }
  return motion;
}

double fitted_exponent(const std::vector<std::pair<double, double>>& size_and_time) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const auto& [size, time] : size_and_time) {
    const double x = std::log(size), y = std::log(time);
    n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

double median_us(const CollisionLibrary& library, const geometry::HapticSurface& surface, double tolerance_m,
                 double depth_m) {
  const collision::HullTree S{collision::ConvexPieces(surface)}, T{collision::ConvexPieces(surface)};
  std::array<Entrant, 1> entrant{{{library.name, false, library.open(S, T, tolerance_m)}}};
  return timings(entrant, tolerance_m, rolling(0.1 - 0.5 * depth_m, depth_m), 3, false)[0].p50_us;
}

}  // namespace

CollisionScaling collision_scaling(const CollisionLibrary& library) {
  std::vector<std::pair<double, double>> hulls, pieces;
  for (const int n : {4, 8, 16, 32}) {
    hulls.emplace_back(n * n, median_us(library, sphere(0.05, n, n + 1, true), 0.005, 0.002));
  }
  for (const int n : {10, 20, 40, 80}) {
    pieces.emplace_back(n * n, median_us(library, sphere(0.05, n, n, false), 0.05 / (n * n), 0.02 / (n * n)));
  }
  return {fitted_exponent(hulls), fitted_exponent(pieces)};
}

}  // namespace farfeel::bench
