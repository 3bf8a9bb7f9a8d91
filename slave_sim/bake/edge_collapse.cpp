// OpenMesh's half-edge structure holds the surface, decides whether a collapse leaves it a surface (the link condition)
// and carries it out. Which edge goes, and where the vertex that is left stands, is decided here:
//
// A vertex carries the quadric Q(p) = p^T A p + 2 b^T p + c, the area-weighted sum of squared distances to the planes
// of all triangles that were ever merged into it. Collapsing edge (u, v) costs Q_u + Q_v at its own minimum.
//
// OpenMesh's Decimater is not used: it moves no vertex, and keeps the costs of edges round one that has moved.
#include "slave_sim/bake/edge_collapse.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "slave_sim/bake/nearest_on_triangle.h"

namespace farfeel::slave_sim {
namespace {

using geometry::Triangle;
using geometry::TriangleMesh;

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::None);  // a triangle's three are found from one another in two steps
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
};
using HalfEdges = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Vertex = HalfEdges::VertexHandle;
using HalfEdge = HalfEdges::HalfedgeHandle;

glm::dvec3 as_glm(const OpenMesh::Vec3d& p) {
  return {p[0], p[1], p[2]};
}

constexpr double kAny = std::numeric_limits<double>::infinity();
/// What has to be left of a sliver's height over its longest side when a corner moves, tried in turn until enough
/// triangles may go. At first there is to be none; then it may stay one, which rounding is no change of: a fan's
/// triangles, of which none may go else; at last slivers about a ring whose vertices merge may lean with every step.
constexpr std::array<double, 3> kOfSliver{kAny, 0.999, 0.9};
constexpr double kFreeCosine = 0.766;  ///< of 40 degrees

/// How far a point is from the nearest side of a triangle.
double off_edges(const glm::dvec3& point, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  double least = kAny;
  for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
    const glm::dvec3 side = to - from;
    const double square = glm::dot(side, side);
    const double share = square > 0 ? std::clamp(glm::dot(point - from, side) / square, 0.0, 1.0) : 0;
    least = std::min(least, glm::length(from + share * side - point));
  }
  return least;
}

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

/// Moving `u` into `v` along their half-edge.
struct Candidate {
  double cost;
  HalfEdge edge;
  Vertex u, v;
  std::uint32_t change_u, change_v;  ///< the vertices' change counts when this was made
  bool operator<(const Candidate& other) const { return cost > other.cost; }  // the queue's top is the cheapest
};

class Collapser {
 public:
  /// most_off, most_edge_off: per vertex, see edge_collapsed().
  Collapser(const TriangleMesh& mesh, std::vector<double> most_off, std::vector<double> most_edge_off)
      : quadric_(mesh.positions_O.size()),
        change_(mesh.positions_O.size()),
        most_off_(std::move(most_off)),
        most_edge_off_(std::move(most_edge_off)) {
    omerr().disable();  // a face that it refuses is no news for the terminal
    mesh_.reserve(mesh.positions_O.size(), mesh.triangles.size() * 3 / 2, mesh.triangles.size());
    for (const glm::dvec3& p : mesh.positions_O) mesh_.add_vertex({p.x, p.y, p.z});
    for (const Triangle& t : mesh.triangles) {
      const auto face = mesh_.add_face(vertex(t[0]), vertex(t[1]), vertex(t[2]));
      if (!face.is_valid()) {
        is_surface_ = false;
        return;
      }
      const glm::dvec3& a = mesh.positions_O[t[0]];
      const glm::dvec3 doubled = glm::cross(mesh.positions_O[t[1]] - a, mesh.positions_O[t[2]] - a);
      const double length = glm::length(doubled);
      const glm::dvec3 n = length > 0 ? doubled / length : glm::dvec3(0);
      const Quadric q = Quadric::plane(n, -glm::dot(n, a), 0.5 * length);
      for (const std::uint32_t v : t) quadric_[v] += q;
    }
    alive_ = mesh.triangles.size();
  }

  [[nodiscard]] bool is_surface() const { return is_surface_; }
  [[nodiscard]] std::size_t alive() const { return alive_; }
  /// Which of kOfSliver holds.
  [[nodiscard]] std::size_t leave() const { return leave_; }
  /// From now on the next of them; false: there is none.
  bool give_leave() {
    if (leave_ + 1 == kOfSliver.size()) return false;
    ++leave_;
    return true;
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
        if (c.cost <= costs[few]) collapse_if_allowed(c);
      }
      if (before - alive_ <= before / 100) return;  // what is left refuses
    }
  }

  /// From now on the surface stays near to where its vertices are now, and edges near to where its free edges are.
  /// False: it need not.
  bool hold() {
    points_of_.assign(mesh_.n_faces(), {});
    for (const Vertex v : mesh_.vertices()) {
      if (most_off_.empty() || mesh_.status(v).deleted() || !(most_off_[v.idx()] < kAny)) continue;
      points_of_[mesh_.cvf_iter(v)->idx()].push_back({p(v), most_off_[v.idx()], false});
      is_held_ = true;
    }
    for (const auto edge : mesh_.edges()) {
      if (most_edge_off_.empty() || mesh_.status(edge).deleted()) continue;
      const HalfEdge half = mesh_.halfedge_handle(edge, 0);
      const Vertex from = mesh_.from_vertex_handle(half), to = mesh_.to_vertex_handle(half);
      const double most_off = std::max(most_edge_off_[from.idx()], most_edge_off_[to.idx()]);
      if (!(most_off < kAny) || !is_free(half)) continue;
      for (const glm::dvec3& point : {p(from), 0.5 * (p(from) + p(to)), p(to)})
        points_of_[mesh_.face_handle(half).idx()].push_back({point, most_off, true});
      is_held_ = true;
    }
    return is_held_;
  }

  /// Strictly cheapest first, as long as they cost no more than `most`. Gives what the dearest cost.
  double finish(std::size_t target, double most) {
    std::priority_queue<Candidate> queue(std::less<Candidate>(), candidates());
    double dearest = 0;
    while (alive_ > target && !queue.empty() && queue.top().cost <= most) {
      const Candidate best = queue.top();
      queue.pop();
      if (!collapse_if_allowed(best)) continue;
      dearest = std::max(dearest, best.cost);
      for (auto h = mesh_.cvoh_iter(best.v); h.is_valid(); ++h) queue.push(candidate(*h));
    }
    return dearest;
  }

  [[nodiscard]] TriangleMesh result() {
    mesh_.garbage_collection();
    TriangleMesh out;
    for (const Vertex v : mesh_.vertices()) out.positions_O.push_back(p(v));
    for (const auto face : mesh_.faces()) {
      Triangle t{};
      std::transform(mesh_.cfv_begin(face), mesh_.cfv_end(face), t.begin(),
                     [](Vertex v) { return static_cast<std::uint32_t>(v.idx()); });
      out.triangles.push_back(t);
    }
    return out;
  }

 private:
  static Vertex vertex(std::uint32_t index) { return Vertex(static_cast<int>(index)); }
  [[nodiscard]] glm::dvec3 p(Vertex v) const { return as_glm(mesh_.point(v)); }
  [[nodiscard]] Quadric merged(Vertex u, Vertex v) const {
    Quadric q = quadric_[u.idx()];
    q += quadric_[v.idx()];
    return q;
  }
  [[nodiscard]] glm::dvec3 place(Vertex u, Vertex v) const { return merged(u, v).minimum_near(0.5 * (p(u) + p(v))); }

  [[nodiscard]] Candidate candidate(HalfEdge edge) const {
    const Vertex u = mesh_.from_vertex_handle(edge), v = mesh_.to_vertex_handle(edge);
    const Quadric q = merged(u, v);
    const glm::dvec3 along = p(u) - p(v);
    constexpr double kShort = 1e-9;  // among equals (flat regions cost nothing) the shortest goes first
    const double square = glm::dot(along, along);
    return {q.at(q.minimum_near(0.5 * (p(u) + p(v)))) + kShort * square * square,
            edge,
            u,
            v,
            change_[u.idx()],
            change_[v.idx()]};
  }

  [[nodiscard]] std::vector<Candidate> candidates() const {
    std::vector<Candidate> all;
    all.reserve(alive_ * 3 / 2);
    for (const auto edge : mesh_.edges())
      if (!mesh_.status(edge).deleted()) all.push_back(candidate(mesh_.halfedge_handle(edge, 0)));
    return all;
  }

  /// No triangle that stays turns by more than a right angle nor becomes a sliver when `moving` goes to `to`.
  [[nodiscard]] bool stays_fine(Vertex moving, Vertex other, const glm::dvec3& to) const {
    for (auto h = mesh_.cvoh_iter(moving); h.is_valid(); ++h) {
      const Vertex a = mesh_.to_vertex_handle(*h), b = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(*h));
      if (a == other || b == other) continue;  // goes away
      const glm::dvec3 p_a = p(a), p_b = p(b), p_moving = p(moving), side = p_b - p_a;
      const glm::dvec3 before = glm::cross(p_a - p_moving, side), after = glm::cross(p_a - to, side);
      const double longest =
          std::max({glm::dot(side, side), glm::dot(p_a - to, p_a - to), glm::dot(p_b - to, p_b - to)});
      constexpr double kLeastCosine = 0.3, kLeastHeight = 0.02;  // height over the longest side
      if (!(glm::dot(before, after) > kLeastCosine * glm::length(before) * glm::length(after))) return false;
      double least = kLeastHeight;
      if (leave_ > 0) {
        const double was_longest = std::max(
            {glm::dot(side, side), glm::dot(p_a - p_moving, p_a - p_moving), glm::dot(p_b - p_moving, p_b - p_moving)});
        least = std::min(least, kOfSliver[leave_] * glm::length(before) / was_longest);
      }
      if (!(glm::length(after) > least * longest)) return false;
    }
    return true;
  }

  /// Whether the surface turns away there.
  [[nodiscard]] bool is_free(HalfEdge half) const {
    const auto corner = [&](HalfEdge h) { return p(mesh_.to_vertex_handle(mesh_.next_halfedge_handle(h))); };
    const glm::dvec3 from = p(mesh_.from_vertex_handle(half)), along = p(mesh_.to_vertex_handle(half)) - from;
    const glm::dvec3 beside = corner(half) - from, beyond = corner(mesh_.opposite_halfedge_handle(half)) - from;
    const glm::dvec3 n = glm::cross(along, beside), n_beyond = glm::cross(beyond, along);
    return glm::dot(n, beyond) < 0 && glm::dot(n, n_beyond) < kFreeCosine * glm::length(n) * glm::length(n_beyond);
  }

  /// What the surface has to stay near to; or, of a free edge, the edges.
  struct Point {
    glm::dvec3 p;
    double most_off;
    bool is_of_edge;
  };
  struct Held {
    Point point;
    int face;  ///< the nearest of those that change
  };

  /// The points that the triangles about u and v hold, each with the one that will be nearest when both vertices have
  /// become one at `to`; nothing if one is too far off then.
  [[nodiscard]] std::optional<std::vector<Held>> held_after(Vertex u, Vertex v, const glm::dvec3& to) const {
    struct Changed {
      int face;
      glm::dvec3 a, b;  ///< the third corner is `to`
    };
    std::vector<Changed> changed;
    std::vector<Held> held;
    const auto gather = [&](Vertex moving, Vertex other) {
      for (auto h = mesh_.cvoh_iter(moving); h.is_valid(); ++h) {
        const int face = mesh_.face_handle(*h).idx();
        const Vertex a = mesh_.to_vertex_handle(*h), b = mesh_.to_vertex_handle(mesh_.next_halfedge_handle(*h));
        const bool goes = a == other || b == other;
        if (goes && moving == v) continue;  // met at u
        if (!goes) changed.push_back({face, p(a), p(b)});
        for (const Point& point : points_of_[face]) held.push_back({point, -1});
      }
    };
    gather(u, v), gather(v, u);
    for (Held& each : held) {
      double least = std::numeric_limits<double>::infinity();
      for (const Changed& c : changed) {
        const double off = each.point.is_of_edge
                               ? off_edges(each.point.p, to, c.a, c.b)
                               : glm::length(nearest_on_triangle(each.point.p, to, c.a, c.b) - each.point.p);
        if (off < least) least = off, each.face = c.face;
      }
      if (!(least <= each.point.most_off)) return std::nullopt;
    }
    return held;
  }

  void pass_on(Vertex u, Vertex v, const std::vector<Held>& held) {
    for (const Vertex each : {u, v}) {
      for (auto f = mesh_.cvf_iter(each); f.is_valid(); ++f) points_of_[f->idx()].clear();
    }
    for (const Held& each : held) points_of_[each.face].push_back(each.point);
  }

  bool collapse_if_allowed(const Candidate& c) {
    if (mesh_.status(c.u).deleted() || mesh_.status(c.v).deleted()) return false;
    if (c.change_u != change_[c.u.idx()] || c.change_v != change_[c.v.idx()]) return false;
    const glm::dvec3 to = place(c.u, c.v);
    if (!std::isfinite(to.x) || !std::isfinite(to.y) || !std::isfinite(to.z)) return false;
    // A corner of three triangles beside the edge would be left with two, back to back.
    const HalfEdge back = mesh_.opposite_halfedge_handle(c.edge);
    for (const HalfEdge side : {c.edge, back}) {
      if (mesh_.valence(mesh_.to_vertex_handle(mesh_.next_halfedge_handle(side))) <= 3) return false;
    }
    if (!stays_fine(c.u, c.v, to) || !stays_fine(c.v, c.u, to) || !mesh_.is_collapse_ok(c.edge)) return false;
    if (is_held_) {
      const auto held = held_after(c.u, c.v, to);
      if (!held) return false;
      pass_on(c.u, c.v, *held);
    }
    mesh_.collapse(c.edge);
    mesh_.set_point(c.v, {to.x, to.y, to.z});
    quadric_[c.v.idx()] += quadric_[c.u.idx()];
    if (!most_off_.empty()) most_off_[c.v.idx()] = std::min(most_off_[c.v.idx()], most_off_[c.u.idx()]);
    if (!most_edge_off_.empty())
      most_edge_off_[c.v.idx()] = std::max(most_edge_off_[c.v.idx()], most_edge_off_[c.u.idx()]);
    ++change_[c.v.idx()];
    alive_ -= 2;
    return true;
  }

  HalfEdges mesh_;
  bool is_surface_ = true;
  std::size_t alive_ = 0;
  std::vector<Quadric> quadric_;
  std::vector<std::uint32_t> change_;             ///< how often the vertex has moved
  std::vector<double> most_off_, most_edge_off_;  ///< per vertex
  bool is_held_ = false;
  std::size_t leave_ = 0;
  std::vector<std::vector<Point>> points_of_;  ///< per face
};

/// The mesh's own size about its middle: quadrics lose no digits to where it stands.
class OwnUnits {
 public:
  explicit OwnUnits(const TriangleMesh& mesh)
      : centre_(geometry::bounding_box(mesh).centre()), size_m_(glm::length(geometry::bounding_box(mesh).size())) {}
  [[nodiscard]] TriangleMesh scaled(TriangleMesh mesh) const {
    for (glm::dvec3& p : mesh.positions_O) p = (p - centre_) / size_m_;
    return mesh;
  }
  [[nodiscard]] std::vector<double> scaled(std::vector<double> lengths_m) const {
    for (double& length : lengths_m) length /= size_m_;
    return lengths_m;
  }
  [[nodiscard]] TriangleMesh unscaled(TriangleMesh mesh) const {
    for (glm::dvec3& p : mesh.positions_O) p = centre_ + size_m_ * p;
    return mesh;
  }

 private:
  glm::dvec3 centre_;
  double size_m_;
};

/// Sweeps down to `triangles`, or until none may go.
void sweep(Collapser& collapser, std::size_t triangles) {
  do collapser.sweep(triangles);
  while (collapser.alive() > triangles && collapser.give_leave());
}

/// The same strictly, as far as the cost and the leave go. Gives what the dearest cost.
double finish(Collapser& collapser, std::size_t triangles, double most, std::size_t most_leave) {
  double dearest = collapser.finish(triangles, most);
  while (collapser.alive() > triangles && collapser.leave() < most_leave && collapser.give_leave())
    dearest = std::max(dearest, collapser.finish(triangles, most));
  return dearest;
}

}  // namespace

TriangleMesh edge_collapsed(const TriangleMesh& mesh, std::uint32_t triangles, const std::vector<double>& most_off_m,
                            const std::vector<double>& most_edge_off_m) {
  if (mesh.triangles.size() <= triangles) return mesh;
  const OwnUnits units(mesh);
  Collapser collapser(units.scaled(mesh), units.scaled(most_off_m), units.scaled(most_edge_off_m));
  if (!collapser.is_surface()) return {};
  constexpr std::size_t kExact = 16;  // times as many triangles as asked for, from where on every step counts
  sweep(collapser, kExact * triangles);
  if (most_off_m.empty() && most_edge_off_m.empty()) {
    finish(collapser, triangles, kAny, kOfSliver.size());
    return units.unscaled(collapser.result());
  }
  Collapser holding = collapser;
  const double dearest = finish(collapser, triangles, kAny, kOfSliver.size());
  if (!holding.hold()) return units.unscaled(collapser.result());
  finish(holding, triangles, dearest, collapser.leave());
  return units.unscaled(holding.result());
}

TriangleMesh edges_swept(const TriangleMesh& mesh, std::uint32_t triangles) {
  if (mesh.triangles.size() <= triangles) return mesh;
  const OwnUnits units(mesh);
  Collapser collapser(units.scaled(mesh), {}, {});
  if (!collapser.is_surface()) return {};
  sweep(collapser, triangles);
  return units.unscaled(collapser.result());
}

}  // namespace farfeel::slave_sim
