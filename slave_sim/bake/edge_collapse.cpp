// A vertex carries the quadric Q(p) = p^T A p + 2 b^T p + c, the area-weighted sum of squared distances to the planes
// of all triangles that were ever merged into it. Collapsing edge (u, v) costs Q_u + Q_v at its own minimum.
//
// Triangles round a vertex are a linked list of corners, so that two vertices merge by joining their lists; corners of
// dead triangles stay in the lists and are skipped. The queue holds stale entries too: an entry counts only while both
// its vertices are as they were when it was made.
#include "slave_sim/bake/edge_collapse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Symmetric 4 x 4, the upper triangle.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, x = 0, y = 0, z = 0, c = 0;

  static Quadric plane(const glm::dvec3& n, double offset, double weight) {
    return {weight * n.x * n.x,    weight * n.x * n.y,      weight * n.x * n.z,    weight * n.y * n.y,
            weight * n.y * n.z,    weight * n.z * n.z,      weight * n.x * offset, weight * n.y * offset,
            weight * n.z * offset, weight * offset * offset};
  }
  Quadric& operator+=(const Quadric& q) {
    xx += q.xx, xy += q.xy, xz += q.xz, yy += q.yy, yz += q.yz, zz += q.zz, x += q.x, y += q.y, z += q.z, c += q.c;
    return *this;
  }
  [[nodiscard]] double at(const glm::dvec3& p) const {
    return xx * p.x * p.x + yy * p.y * p.y + zz * p.z * p.z + 2 * (xy * p.x * p.y + xz * p.x * p.z + yz * p.y * p.z) +
           2 * (x * p.x + y * p.y + z * p.z) + c;
  }
  /// Where it is least, drawn weakly towards `near` where planes leave it free.
  [[nodiscard]] glm::dvec3 minimum_near(const glm::dvec3& near) const {
    constexpr double kPull = 1e-7;  // of the planes together: enough to decide where they do not
    const double pull = kPull * (xx + yy + zz) + std::numeric_limits<double>::min();
    const glm::dmat3 A(xx + pull, xy, xz, xy, yy + pull, yz, xz, yz, zz + pull);
    return near - glm::inverse(A) * (glm::dvec3(xx * near.x + xy * near.y + xz * near.z + x,
                                                xy * near.x + yy * near.y + yz * near.z + y,
                                                xz * near.x + yz * near.y + zz * near.z + z));
  }
};

struct Candidate {
  double cost;
  std::uint32_t u, v, change_u, change_v;  ///< the vertices' change counts when this was made
  bool operator<(const Candidate& other) const { return cost > other.cost; }  // the queue's top is the cheapest
};

class Collapser {
 public:
  explicit Collapser(const TriangleMesh& mesh)
      : p_(mesh.positions_O),
        triangles_(mesh.triangles),
        alive_(mesh.triangles.size()),
        head_(p_.size(), kNone),
        tail_(p_.size(), kNone),
        next_(3 * triangles_.size(), kNone),
        quadric_(p_.size()),
        change_(p_.size()),
        seen_(p_.size()) {
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      const glm::dvec3 doubled = doubled_area(t);
      const double length = glm::length(doubled);
      const glm::dvec3 n = length > 0 ? doubled / length : glm::dvec3(0);
      const Quadric q = Quadric::plane(n, -glm::dot(n, p_[triangles_[t][0]]), 0.5 * length);
      for (std::uint32_t k = 0; k < 3; ++k) {
        append(triangles_[t][k], 3 * t + k);
        quadric_[triangles_[t][k]] += q;
      }
    }
  }

  /// Sweeps over all edges, each collapsing the cheapest quarter as far as they do not touch each other: near enough to
  /// cheapest first while many triangles are left, and in the mesh's own order, which memory likes.
  void sweep(std::size_t target) {
    while (alive_ > target) {
      const std::vector<Candidate> all = candidates();
      std::vector<double> costs;
      for (const Candidate& c : all) costs.push_back(c.cost);
      const std::size_t few = std::min(all.size() / 4, (alive_ - target) / 2);
      std::nth_element(costs.begin(), costs.begin() + static_cast<std::ptrdiff_t>(few), costs.end());
      const std::size_t before = alive_;
      for (const Candidate& c : all) {
        if (c.cost > costs[few] || c.change_u != change_[c.u] || c.change_v != change_[c.v]) continue;
        const glm::dvec3 to = place(c.u, c.v);
        if (is_allowed(c.u, c.v, to)) collapse(c.u, c.v, to);
      }
      if (before - alive_ <= before / 100) return;  // what is left refuses
    }
  }

  /// Strictly cheapest first.
  void finish(std::size_t target) {
    queue_ = std::priority_queue<Candidate>(std::less<Candidate>(), candidates());
    while (alive_ > target && !queue_.empty()) {
      const Candidate best = queue_.top();
      queue_.pop();
      if (best.change_u != change_[best.u] || best.change_v != change_[best.v]) continue;
      const glm::dvec3 to = place(best.u, best.v);
      if (!is_allowed(best.u, best.v, to)) continue;
      collapse(best.u, best.v, to);
      round(best.u, [&](std::uint32_t t) {
        const Triangle& c = triangles_[t];  // each neighbour is the next corner in exactly one of the triangles
        for (std::size_t k = 0; k < 3; ++k) {
          if (c[k] == best.u) queue_.push(candidate(best.u, c[(k + 1) % 3]));
        }
      });
    }
  }

  [[nodiscard]] TriangleMesh result() const {
    TriangleMesh out;
    std::vector<std::uint32_t> name(p_.size(), kNone);
    for (const Triangle& t : triangles_) {
      if (t[0] == kNone) continue;
      Triangle renamed{};
      for (std::size_t k = 0; k < 3; ++k) {
        if (name[t[k]] == kNone) {
          name[t[k]] = static_cast<std::uint32_t>(out.positions_O.size());
          out.positions_O.push_back(p_[t[k]]);
        }
        renamed[k] = name[t[k]];
      }
      out.triangles.push_back(renamed);
    }
    return out;
  }

 private:
  [[nodiscard]] std::vector<Candidate> candidates() const {
    std::vector<Candidate> all;
    all.reserve(alive_ * 3 / 2);
    for (const Triangle& t : triangles_) {
      if (t[0] == kNone) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        if (t[k] < t[(k + 1) % 3]) all.push_back(candidate(t[k], t[(k + 1) % 3]));
      }
    }
    return all;
  }

  [[nodiscard]] glm::dvec3 doubled_area(std::uint32_t t) const {
    const Triangle& v = triangles_[t];
    return glm::cross(p_[v[1]] - p_[v[0]], p_[v[2]] - p_[v[0]]);
  }

  void append(std::uint32_t vertex, std::uint32_t corner) {
    (head_[vertex] == kNone ? head_[vertex] : next_[tail_[vertex]]) = corner;
    tail_[vertex] = corner;
  }

  /// Calls visit(triangle) for every living triangle round v, and unlinks the dead ones it meets.
  template <typename Visit>
  void round(std::uint32_t v, Visit visit) {
    std::uint32_t before = kNone;
    for (std::uint32_t corner = head_[v]; corner != kNone; corner = next_[corner]) {
      if (triangles_[corner / 3][0] == kNone) {
        (before == kNone ? head_[v] : next_[before]) = next_[corner];
        if (tail_[v] == corner) tail_[v] = before;
        continue;
      }
      before = corner;
      visit(corner / 3);
    }
  }

  [[nodiscard]] glm::dvec3 place(std::uint32_t u, std::uint32_t v) const {
    Quadric q = quadric_[u];
    q += quadric_[v];
    return q.minimum_near(0.5 * (p_[u] + p_[v]));
  }

  [[nodiscard]] Candidate candidate(std::uint32_t u, std::uint32_t v) const {
    Quadric q = quadric_[u];
    q += quadric_[v];
    const glm::dvec3 edge = p_[u] - p_[v];
    constexpr double kShort = 1e-9;  // among equals (flat regions cost nothing) the shortest goes first
    return {q.at(q.minimum_near(0.5 * (p_[u] + p_[v]))) + kShort * glm::dot(edge, edge) * glm::dot(edge, edge), u, v,
            change_[u], change_[v]};
  }

  /// The two ends share exactly two neighbours (the link condition on a closed surface), and no triangle that stays
  /// turns by more than a right angle nor becomes a sliver.
  bool is_allowed(std::uint32_t u, std::uint32_t v, const glm::dvec3& to) {
    if (!is_finite(to)) return false;
    ++mark_;
    round(u, [&](std::uint32_t t) {
      for (const std::uint32_t w : triangles_[t]) seen_[w] = mark_;
    });
    seen_[u] = seen_[v] = 0;
    int common = 0;
    bool is_fine = true;
    const auto stays_fine = [&](std::uint32_t t, std::uint32_t moving, std::uint32_t other) {
      const Triangle& c = triangles_[t];
      if (c[0] == other || c[1] == other || c[2] == other) return;  // goes away
      std::array<glm::dvec3, 3> q{p_[c[0]], p_[c[1]], p_[c[2]]};
      const glm::dvec3 before = glm::cross(q[1] - q[0], q[2] - q[0]);
      for (std::size_t k = 0; k < 3; ++k) {
        if (c[k] == moving) q[k] = to;
      }
      const glm::dvec3 after = glm::cross(q[1] - q[0], q[2] - q[0]);
      const double longest = std::max(
          {glm::dot(q[1] - q[0], q[1] - q[0]), glm::dot(q[2] - q[1], q[2] - q[1]), glm::dot(q[0] - q[2], q[0] - q[2])});
      constexpr double kLeastCosine = 0.3, kLeastHeight = 0.02;  // height over the longest side
      if (!(glm::dot(before, after) > kLeastCosine * glm::length(before) * glm::length(after)) ||
          !(glm::length(after) > kLeastHeight * longest)) {
        is_fine = false;
      }
    };
    round(v, [&](std::uint32_t t) {
      for (const std::uint32_t w : triangles_[t]) {
        if (seen_[w] == mark_) ++common, seen_[w] = 0;
      }
      stays_fine(t, v, u);
    });
    if (common != 2 || !is_fine) return false;
    round(u, [&](std::uint32_t t) { stays_fine(t, u, v); });
    return is_fine;
  }

  void collapse(std::uint32_t u, std::uint32_t v, const glm::dvec3& to) {
    round(v, [&](std::uint32_t t) {
      Triangle& c = triangles_[t];
      if (c[0] == u || c[1] == u || c[2] == u) {
        c[0] = kNone;
        --alive_;
        return;
      }
      for (std::uint32_t& w : c) {
        if (w == v) w = u;
      }
    });
    if (head_[v] != kNone) {
      (head_[u] == kNone ? head_[u] : next_[tail_[u]]) = head_[v];
      tail_[u] = tail_[v];
      head_[v] = tail_[v] = kNone;
    }
    p_[u] = to;
    quadric_[u] += quadric_[v];
    ++change_[u], ++change_[v];
  }

  static bool is_finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

  std::vector<glm::dvec3> p_;
  std::vector<Triangle> triangles_;  ///< a dead one names kNone first
  std::size_t alive_;
  std::vector<std::uint32_t> head_, tail_, next_;  ///< corner lists
  std::vector<Quadric> quadric_;
  std::vector<std::uint32_t> change_, seen_;
  std::uint32_t mark_ = 0;
  std::priority_queue<Candidate> queue_;
};

}  // namespace

TriangleMesh edge_collapsed(const TriangleMesh& mesh, std::uint32_t triangles) {
  if (mesh.triangles.size() <= triangles) return mesh;
  // In units of the mesh's own size about its middle: quadrics lose no digits to where it stands.
  const geometry::Box box = geometry::bounding_box(mesh);
  const double size_m = glm::length(box.size());
  TriangleMesh scaled = mesh;
  for (glm::dvec3& p : scaled.positions_O) p = (p - box.centre()) / size_m;
  Collapser collapser(scaled);
  constexpr std::size_t kExact = 16;  // times as many triangles as asked for, from where on every step counts
  collapser.sweep(kExact * triangles);
  collapser.finish(triangles);
  TriangleMesh out = collapser.result();
  for (glm::dvec3& p : out.positions_O) p = box.centre() + size_m * p;
  return out;
}

}  // namespace farfeel::slave_sim
