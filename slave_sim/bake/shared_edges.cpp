// Triangles round an edge a -> b, d its direction: one that runs along it has the normal d x w, w its third corner's
// direction from the edge, and the solid behind it, so at lesser angles about d; one that runs against it has the solid
// at greater ones. Sorted by angle they take turns, and a solid lies between one that runs against and the next that
// runs along.
#include "slave_sim/bake/shared_edges.h"

#include <cmath>
#include <numeric>
#include <optional>

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

/// A corner of a triangle, as one number.
using Corner = std::size_t;
Corner corner_of(const TriangleMesh& mesh, std::uint32_t triangle, std::uint32_t vertex) {
  const Triangle& t = mesh.triangles[triangle];
  return 3 * std::size_t{triangle} + (t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2);
}

/// Corners that are one vertex, joined step by step.
class Groups {
 public:
  explicit Groups(std::size_t count) : leader_(count) { std::iota(leader_.begin(), leader_.end(), Corner{0}); }
  Corner of(Corner c) {
    while (leader_[c] != c) c = leader_[c] = leader_[leader_[c]];
    return c;
  }
  void join(Corner a, Corner b) { leader_[std::max(of(a), of(b))] = std::min(of(a), of(b)); }

 private:
  std::vector<Corner> leader_;
};

/// The triangles round an edge, two by two; empty if they do not take turns.
std::vector<std::uint32_t> pairs_round(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b,
                                       const std::vector<std::uint32_t>& sharing) {
  const glm::dvec3 pa = mesh.positions_O[a], d = glm::normalize(mesh.positions_O[b] - pa);
  struct Spoke {
    double angle;
    std::uint32_t triangle;
    bool runs_along;
  };
  std::vector<Spoke> spokes;
  glm::dvec3 u(0), v(0);
  for (const std::uint32_t i : sharing) {
    const Triangle& t = mesh.triangles[i];
    const std::uint32_t third = t[0] != a && t[0] != b ? t[0] : t[1] != a && t[1] != b ? t[1] : t[2];
    glm::dvec3 w = mesh.positions_O[third] - pa;
    w -= glm::dot(w, d) * d;
    const double width_m = glm::length(w);
    if (!(width_m > 0)) return {};  // it has no area, and no angle
    if (spokes.empty()) u = w / width_m, v = glm::cross(d, u);
    double angle = std::atan2(glm::dot(w, v), glm::dot(w, u));
    constexpr double kSame = 1e-7;
    if (angle < -kSame) angle += 2 * std::acos(-1.0);
    spokes.push_back({angle, i, runs(t, a, b)});
  }
  std::sort(spokes.begin(), spokes.end(), [](const Spoke& l, const Spoke& r) { return l.angle < r.angle; });
  const std::size_t n = spokes.size(), first = spokes[0].runs_along ? 1 : 0;  // one that runs against
  std::vector<std::uint32_t> pairs;
  for (std::size_t i = 0; i < n; ++i) {
    const Spoke& spoke = spokes[(first + i) % n];
    if (spoke.runs_along != (i % 2 == 1)) return {};
    pairs.push_back(spoke.triangle);
  }
  return n % 2 == 0 ? pairs : std::vector<std::uint32_t>();
}

/// The corner after which the triangle has a border's edge, and the border's vertices on it, in their order.
struct Cut {
  std::size_t corner;
  std::vector<std::uint32_t> vertices;
};

}  // namespace

Found cut_at_t_junctions(TriangleMesh& mesh, double width_m) {
  Found cuts;
  constexpr std::size_t kMostBorder = 50'000;  // triangles: work grows with their square, and such a mesh is no solid
  constexpr int kRounds = 4;  // one for each border's edge that a triangle may have, and one to see that none is left
  for (int round = 0; round < kRounds; ++round) {
    const Edges edges = edges_of(mesh);
    std::vector<std::pair<double, std::uint32_t>> border;  // by x
    std::vector<std::uint32_t> edge_triangles;
    for (const auto& [key, sharing] : edges) {
      if (sharing.size() != 1) continue;
      edge_triangles.push_back(sharing[0]);
      for (const std::uint64_t v : {key >> 32, key & 0xFFFF'FFFF})
        border.emplace_back(mesh.positions_O[v].x, static_cast<std::uint32_t>(v));
    }
    std::sort(border.begin(), border.end());
    border.erase(std::unique(border.begin(), border.end()), border.end());
    std::sort(edge_triangles.begin(), edge_triangles.end());
    edge_triangles.erase(std::unique(edge_triangles.begin(), edge_triangles.end()), edge_triangles.end());
    if (edge_triangles.size() > kMostBorder) break;
    const auto cut_of = [&](const Triangle& t) -> std::optional<Cut> {
      for (std::size_t k = 0; k < 3; ++k) {
        if (edges.at(edge_key(t[k], t[(k + 1) % 3])).size() != 1) continue;
        const glm::dvec3 a = mesh.positions_O[t[k]], ab = mesh.positions_O[t[(k + 1) % 3]] - a;
        const double length_m = glm::length(ab);
        std::vector<std::pair<double, std::uint32_t>> on;
        for (auto at = std::lower_bound(border.begin(), border.end(),
                                        std::pair(std::min(a.x, a.x + ab.x) - width_m, std::uint32_t{0}));
             at != border.end() && at->first <= std::max(a.x, a.x + ab.x) + width_m; ++at) {
          const glm::dvec3 ap = mesh.positions_O[at->second] - a;
          const double along_m = glm::dot(ap, ab) / length_m;
          if (along_m <= width_m || along_m >= length_m - width_m) continue;
          if (glm::length(ap - along_m / length_m * ab) <= width_m && at->second != t[(k + 2) % 3])
            on.emplace_back(along_m, at->second);
        }
        if (on.empty()) continue;
        std::sort(on.begin(), on.end());
        Cut cut{.corner = k, .vertices = {}};
        for (const auto& [along_m, v] : on) cut.vertices.push_back(v);
        return cut;
      }
      return std::nullopt;
    };
    const std::size_t before = cuts.count;
    for (const std::uint32_t i : edge_triangles) {
      const auto cut = cut_of(mesh.triangles[i]);
      if (!cut) continue;
      const Triangle t = mesh.triangles[i];
      const std::uint32_t end = t[(cut->corner + 1) % 3], apex = t[(cut->corner + 2) % 3];
      std::uint32_t from = cut->vertices[0];
      mesh.triangles[i] = {t[cut->corner], from, apex};
      for (std::size_t n = 1; n <= cut->vertices.size(); ++n) {
        const std::uint32_t to = n < cut->vertices.size() ? cut->vertices[n] : end;
        mesh.triangles.push_back({from, to, apex});
        from = to;
      }
      for (const std::uint32_t v : cut->vertices) cuts.add(mesh.positions_O[v]);
    }
    if (cuts.count == before) break;
  }
  return cuts;
}

Found part_shared_edges(TriangleMesh& mesh, const Edges& edges) {
  Groups groups(3 * mesh.triangles.size());
  Found parted;
  const auto join = [&](std::uint32_t one, std::uint32_t other, std::uint32_t a, std::uint32_t b) {
    for (const std::uint32_t v : {a, b}) groups.join(corner_of(mesh, one, v), corner_of(mesh, other, v));
  };
  std::vector<bool> is_near(mesh.positions_O.size());  // at an edge that was parted
  for (const auto& [key, sharing] : edges) {
    const auto a = static_cast<std::uint32_t>(key >> 32), b = static_cast<std::uint32_t>(key);
    const auto pairs = sharing.size() > 2 ? pairs_round(mesh, a, b, sharing) : std::vector<std::uint32_t>();
    for (std::size_t i = 0; i + 1 < pairs.size(); i += 2) join(pairs[i], pairs[i + 1], a, b);
    if (!pairs.empty()) parted.add(mesh.positions_O[a]), is_near[a] = is_near[b] = true;
    if (pairs.empty()) {
      for (std::size_t i = 1; i < sharing.size(); ++i) join(sharing[0], sharing[i], a, b);
    }
  }
  if (parted.count == 0) return parted;
  std::vector<std::uint32_t> name(3 * mesh.triangles.size(), 0);
  std::vector<bool> is_taken(mesh.positions_O.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Corner corner = 3 * std::size_t{i} + k, leader = groups.of(corner);
      std::uint32_t& v = mesh.triangles[i][k];
      if (!is_near[v]) continue;
      if (leader == corner) {  // the first of its group: groups are led by their least corner
        name[leader] = v;
        if (is_taken[v]) {
          name[leader] = static_cast<std::uint32_t>(mesh.positions_O.size());
          mesh.positions_O.push_back(mesh.positions_O[v]);
        }
        is_taken[v] = true;
      }
      v = name[leader];
    }
  }
  return parted;
}

}  // namespace farfeel::slave_sim
