#include "slave_sim/bake/left_out.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "slave_sim/bake/triangle_tree.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

glm::dvec3 middle_of(const TriangleMesh& mesh, const Triangle& t) {
  return (mesh.positions_O[t[0]] + mesh.positions_O[t[1]] + mesh.positions_O[t[2]]) / 3.0;
}

/// With corners of its own.
void add_triangle(TriangleMesh& to, const TriangleMesh& mesh, const Triangle& t) {
  const auto first = static_cast<std::uint32_t>(to.positions_O.size());
  for (const std::uint32_t v : t) to.positions_O.push_back(mesh.positions_O[v]);
  to.triangles.push_back({first, first + 1, first + 2});
}

/// Keeps those triangles; gives back the others.
template <typename IsKept>
TriangleMesh keep(TriangleMesh& mesh, IsKept is_kept) {
  TriangleMesh dropped;
  std::vector<Triangle> kept;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (is_kept(i)) {
      kept.push_back(mesh.triangles[i]);
    } else {
      add_triangle(dropped, mesh, mesh.triangles[i]);
    }
  }
  mesh.triangles = std::move(kept);
  return dropped;
}

std::vector<double> areas_of(const TriangleMesh& mesh, const Shells& shells) {
  std::vector<double> area(shells.count);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const glm::dvec3& a = mesh.positions_O[t[0]];
    area[shells.of_triangle[i]] +=
        0.5 * glm::length(glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a));
  }
  return area;
}

/// Whole shells, those that is_left_out(shell); each counts once.
template <typename IsLeftOut>
LeftOut leave_out(TriangleMesh& mesh, const Shells& shells, const IsLeftOut& is_left_out) {
  LeftOut out;
  std::vector<bool> is_met(shells.count);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::uint32_t shell = shells.of_triangle[i];
    if (is_met[shell] || !is_left_out(shell)) continue;
    is_met[shell] = true;
    out.shells.add(middle_of(mesh, mesh.triangles[i]));
  }
  if (out.shells.count == shells.count) return {};  // it is made of nothing else
  if (out.shells.count == 0) return out;
  const std::vector<double> areas = areas_of(mesh, shells);
  for (std::uint32_t shell = 0; shell < shells.count; ++shell) out.area_share += is_met[shell] ? areas[shell] : 0;
  out.area_share /= std::accumulate(areas.begin(), areas.end(), 0.0);
  out.mesh = keep(mesh, [&](std::uint32_t i) { return !is_left_out(shells.of_triangle[i]); });
  return out;
}

}  // namespace

Doubled drop_degenerate_and_doubled(TriangleMesh& mesh) {
  Doubled dropped;
  std::vector<std::pair<Triangle, std::uint32_t>> by_corners;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    Triangle t = mesh.triangles[i];
    std::sort(t.begin(), t.end());
    if (t[0] != t[1] && t[1] != t[2]) {
      by_corners.emplace_back(t, i);
    } else {
      dropped.degenerate.add(mesh.positions_O[t[0]]);
    }
  }
  std::sort(by_corners.begin(), by_corners.end());
  const auto is_even = [&](std::uint32_t i) {
    const Triangle& t = mesh.triangles[i];
    return (t[0] < t[1]) + (t[1] < t[2]) + (t[2] < t[0]) == 2;
  };
  std::vector<bool> is_kept(mesh.triangles.size());
  for (std::size_t i = 0, end = 0; i < by_corners.size(); i = end) {
    std::array<std::size_t, 2> copies{};  // odd, even
    std::array<std::uint32_t, 2> last{};
    for (end = i; end < by_corners.size() && by_corners[end].first == by_corners[i].first; ++end) {
      const bool even = is_even(by_corners[end].second);
      ++copies[even];
      last[even] = by_corners[end].second;
    }
    const Triangle& t = mesh.triangles[by_corners[i].second];
    const bool is_fold = copies[0] == copies[1];  // as many this way as that way: nothing inside
    for (std::size_t extra = is_fold ? 0 : 1; extra < copies[0] + copies[1]; ++extra)
      (is_fold ? dropped.folded : dropped.doubled).add(middle_of(mesh, t));
    if (is_fold) {
      add_triangle(dropped.folds, mesh, t);
    } else {
      is_kept[last[copies[1] > copies[0]]] = true;
    }
  }
  (void)keep(mesh, [&](std::uint32_t i) { return is_kept[i]; });
  return dropped;
}

LeftOut drop_fins(TriangleMesh& mesh, const Shells& shells, const Edges& edges, double size_m) {
  std::vector<geometry::Box> boxes(shells.count);
  std::vector<bool> has_border(shells.count), hangs(shells.count);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t v : mesh.triangles[i]) boxes[shells.of_triangle[i]].include(mesh.positions_O[v]);
  }
  for (const auto& [key, sharing] : edges) {
    for (const std::uint32_t i : sharing) {
      if (sharing.size() == 1) has_border[shells.of_triangle[i]] = true;
      if (sharing.size() > 2) hangs[shells.of_triangle[i]] = true;
    }
  }
  return leave_out(mesh, shells, [&](std::uint32_t shell) {
    return has_border[shell] && hangs[shell] && glm::length(boxes[shell].size()) <= size_m;
  });
}

LeftOut drop_specks(TriangleMesh& mesh, const Shells& shells, double least) {
  const std::vector<double> areas = areas_of(mesh, shells);
  const double whole = std::accumulate(areas.begin(), areas.end(), 0.0);
  return leave_out(mesh, shells, [&](std::uint32_t shell) { return areas[shell] < least * whole; });
}

void drop_unused_vertices(TriangleMesh& mesh) {
  std::vector<std::uint32_t> name(mesh.positions_O.size(), kNone);
  std::vector<glm::dvec3> positions;
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) {
      if (name[v] == kNone)
        name[v] = static_cast<std::uint32_t>(positions.size()), positions.push_back(mesh.positions_O[v]);
      v = name[v];
    }
  }
  mesh.positions_O = std::move(positions);
}

TriangleMesh outside_of(const TriangleMesh& mesh, TriangleMesh pieces) {
  if (pieces.triangles.empty()) return pieces;
  const TriangleTree tree(mesh);
  (void)keep(pieces, [&](std::uint32_t i) { return !tree.is_inside(middle_of(pieces, pieces.triangles[i])); });
  drop_unused_vertices(pieces);
  return pieces;
}

void append(TriangleMesh& to, const TriangleMesh& more) {
  for (const Triangle& t : more.triangles) add_triangle(to, more, t);
}

}  // namespace farfeel::slave_sim
