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
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

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
  explicit Collapser(const TriangleMesh& mesh) : quadric_(mesh.positions_O.size()), change_(mesh.positions_O.size()) {
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

  /// Strictly cheapest first.
  void finish(std::size_t target) {
    std::priority_queue<Candidate> queue(std::less<Candidate>(), candidates());
    while (alive_ > target && !queue.empty()) {
      const Candidate best = queue.top();
      queue.pop();
      if (!collapse_if_allowed(best)) continue;
      for (auto h = mesh_.cvoh_iter(best.v); h.is_valid(); ++h) queue.push(candidate(*h));
    }
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
    for (const auto edge : mesh_.edges()) all.push_back(candidate(mesh_.halfedge_handle(edge, 0)));
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
      if (!(glm::length(after) > kLeastHeight * longest)) return false;
    }
    return true;
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
    mesh_.collapse(c.edge);
    mesh_.set_point(c.v, {to.x, to.y, to.z});
    quadric_[c.v.idx()] += quadric_[c.u.idx()];
    ++change_[c.v.idx()];
    alive_ -= 2;
    return true;
  }

  HalfEdges mesh_;
  bool is_surface_ = true;
  std::size_t alive_ = 0;
  std::vector<Quadric> quadric_;
  std::vector<std::uint32_t> change_;  ///< how often the vertex has moved
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
  if (!collapser.is_surface()) return {};
  constexpr std::size_t kExact = 16;  // times as many triangles as asked for, from where on every step counts
  collapser.sweep(kExact * triangles);
  collapser.finish(triangles);
  TriangleMesh out = collapser.result();
  for (glm::dvec3& p : out.positions_O) p = box.centre() + size_m * p;
  return out;
}

}  // namespace farfeel::slave_sim
