// A rim of n x m squares and two caps of r rings of squares closed by a fan: 2 n (m + 1 + 2 r) triangles.
// Full: n = 1280, m = 5, r = 2. Coarse: n = 400, m = 1, r = 0.
#include <cmath>
#include <numbers>

#include "slave_sim/models/models.h"

namespace farfeel::slave_sim {
namespace {

constexpr double kRadius_m = 0.060, kHalfWidth_m = 0.015, kDepth_m = 0.0015;
constexpr std::uint32_t kRidges = 60;
// The base's rim stands this share of the ridges' depth inside the crests: deeper, less of the caps is felt that is not
// there beyond the valleys, and more is missing inside the crests.
constexpr double kBaseDepth = 0.62;

template <typename RadiusAt>
geometry::TriangleMesh drum(std::uint32_t n, std::uint32_t m, std::uint32_t r, RadiusAt radius_m) {
  geometry::TriangleMesh mesh;
  // Rows of n vertices from the lower cap's innermost ring, out, up the rim, and in again to the upper cap's.
  struct Row {
    double share_of_radius, z_m;
  };
  std::vector<Row> rows;
  for (std::uint32_t i = 1; i <= r; ++i) rows.push_back({static_cast<double>(i) / (r + 1), -kHalfWidth_m});
  for (std::uint32_t i = 0; i <= m; ++i) rows.push_back({1, kHalfWidth_m * (2.0 * i / m - 1)});
  for (std::uint32_t i = r; i >= 1; --i) rows.push_back({static_cast<double>(i) / (r + 1), kHalfWidth_m});

  for (const Row& row : rows) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n;
      const double radius = row.share_of_radius * radius_m(angle);
      mesh.positions_O.emplace_back(radius * std::cos(angle), radius * std::sin(angle), row.z_m);
    }
  }
  const auto centre = static_cast<std::uint32_t>(mesh.positions_O.size());
  mesh.positions_O.emplace_back(0, 0, -kHalfWidth_m);
  mesh.positions_O.emplace_back(0, 0, kHalfWidth_m);

  const auto last = static_cast<std::uint32_t>(rows.size() - 1) * n;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    mesh.triangles.push_back({centre, next, i});
    for (std::uint32_t row = 0; row < last; row += n) {
      mesh.triangles.push_back({row + i, row + next, row + n + next});
      mesh.triangles.push_back({row + i, row + n + next, row + n + i});
    }
    mesh.triangles.push_back({centre + 1, last + i, last + next});
  }
  return mesh;
}

}  // namespace

geometry::TriangleMesh gear_mesh() {
  return drum(1280, 5, 2, [](double angle) { return kRadius_m - 0.5 * kDepth_m * (1 - std::cos(kRidges * angle)); });
}

geometry::TriangleMesh gear_base() {
  return drum(400, 1, 0, [](double) { return kRadius_m - kBaseDepth * kDepth_m; });
}

}  // namespace farfeel::slave_sim
