#include "slave_sim/models/lattice_solid.h"

#include <limits>

namespace farfeel::slave_sim {
namespace {

constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

/// One axis of the lattice: where its grid lines stand, and which cell each step belongs to.
struct Axis {
  std::vector<double> line_m;
  std::vector<int> cell;  ///< per step

  Axis(const std::vector<double>& cuts_m, const std::vector<std::uint32_t>& steps) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      for (std::uint32_t s = 0; s < steps[i]; ++s) {
        const double along = static_cast<double>(s) / steps[i];
        line_m.push_back(cuts_m[i] + along * (cuts_m[i + 1] - cuts_m[i]));
        cell.push_back(static_cast<int>(i));
      }
    }
    line_m.push_back(cuts_m.back());
  }
  [[nodiscard]] int steps() const { return static_cast<int>(cell.size()); }
};

}  // namespace

glm::dvec3 LatticePoint::outward() const {
  glm::dvec3 sum(0);
  for (int axis = 0; axis < 3; ++axis) sum[axis] = (is_on(axis, 1) ? 1.0 : 0.0) - (is_on(axis, 0) ? 1.0 : 0.0);
  return sum;
}

geometry::TriangleMesh skin(const LatticeSolid& solid, const std::function<glm::dvec3(const LatticePoint&)>& place) {
  const std::array<Axis, 3> axes{Axis(solid.cuts_m[0], solid.steps[0]), Axis(solid.cuts_m[1], solid.steps[1]),
                                 Axis(solid.cuts_m[2], solid.steps[2])};
  const auto is_filled = [&](const std::array<int, 3>& at) {
    for (int a = 0; a < 3; ++a) {
      if (at[a] < 0 || at[a] >= axes[a].steps()) return false;
    }
    return solid.is_solid(axes[0].cell[at[0]], axes[1].cell[at[1]], axes[2].cell[at[2]]);
  };

  std::array<std::size_t, 3> lines{};
  for (int a = 0; a < 3; ++a) lines[a] = axes[a].line_m.size();
  std::vector<std::uint32_t> vertex_at(lines[0] * lines[1] * lines[2], kUnused);
  std::vector<LatticePoint> points;
  geometry::TriangleMesh mesh;

  const auto vertex = [&](const std::array<int, 3>& at, int axis, int side) {
    std::uint32_t& index = vertex_at[(at[0] * lines[1] + at[1]) * lines[2] + at[2]];
    if (index == kUnused) {
      index = static_cast<std::uint32_t>(points.size());
      points.push_back({.p = {axes[0].line_m[at[0]], axes[1].line_m[at[1]], axes[2].line_m[at[2]]}});
    }
    points[index].faces[axis][side] = true;
    return index;
  };

  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::array<int, 3> at{};
    for (at[axis] = 0; at[axis] <= axes[axis].steps(); ++at[axis]) {
      for (at[u] = 0; at[u] < axes[u].steps(); ++at[u]) {
        for (at[v] = 0; at[v] < axes[v].steps(); ++at[v]) {
          std::array<int, 3> below = at;
          --below[axis];
          const bool filled_below = is_filled(below), filled_above = is_filled(at);
          if (filled_below == filled_above) continue;
          const int side = filled_below ? 1 : 0;
          std::array<std::array<int, 3>, 4> corner{at, at, at, at};
          ++corner[1][u], ++corner[2][u], ++corner[2][v], ++corner[3][v];
          std::array<std::uint32_t, 4> c{};
          for (int i = 0; i < 4; ++i) c[i] = vertex(corner[i], axis, side);
          if (side == 0) std::swap(c[1], c[3]);
          if ((at[u] + at[v]) % 2 == 0) {
            mesh.triangles.push_back({c[0], c[1], c[2]});
            mesh.triangles.push_back({c[0], c[2], c[3]});
          } else {
            mesh.triangles.push_back({c[0], c[1], c[3]});
            mesh.triangles.push_back({c[1], c[2], c[3]});
          }
        }
      }
    }
  }
  mesh.positions_O.reserve(points.size());
  for (const LatticePoint& point : points) mesh.positions_O.push_back(place(point));
  return mesh;
}

}  // namespace farfeel::slave_sim
