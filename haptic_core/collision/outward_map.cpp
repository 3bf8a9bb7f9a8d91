#include "haptic_core/collision/outward_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfeel::collision {
namespace {

using glm::cross;
using glm::dot;
using glm::dvec3;
using Index = std::uint32_t;

constexpr Index kNone = 0xFFFF'FFFF;

constexpr double kOnRim = 1e-10;                             // cosine
constexpr double kSameAngle = 1e-9;                          // rad: corners nearer than this are one
constexpr double kWidest = 2 * std::numbers::pi / 3 + 1e-3;  // rad: longer arcs are cut

double outwardness(std::span<const dvec3> outwards, const dvec3& d) {
  double best = -1;
  for (const dvec3& n : outwards) best = std::max(best, dot(n, d));
  return best;
}

// The rim's part across one outward normal n: angles of its corners about n, and the arcs between them.
class RimCircle {
 public:
  RimCircle(const dvec3& n, const dvec3& any_direction) {
    u_ = cross(n, any_direction);
    v_ = cross(n, u_);
  }
  [[nodiscard]] dvec3 at(double angle) const { return std::cos(angle) * u_ + std::sin(angle) * v_; }
  void add(const dvec3& d) { angles_.push_back(std::atan2(dot(d, v_), dot(d, u_))); }

  // Corners in order, each once, with more between those far apart; the first again at the end, a turn later.
  [[nodiscard]] std::vector<double> corners() {
    if (angles_.empty()) angles_.push_back(0);
    std::sort(angles_.begin(), angles_.end());
    std::vector<double> result;
    for (std::size_t i = 0; i < angles_.size(); ++i) {
      const double next = i + 1 < angles_.size() ? angles_[i + 1] : angles_[0] + 2 * std::numbers::pi;
      const double gap = next - angles_[i];
      if (gap < kSameAngle) continue;
      const int parts = 1 + int(gap / kWidest);
      for (int k = 0; k < parts; ++k) result.push_back(angles_[i] + gap * k / parts);
    }
    result.push_back(result.front() + 2 * std::numbers::pi);
    return result;
  }

 private:
  dvec3 u_, v_;
  std::vector<double> angles_;
};

dvec3 perpendicular(const dvec3& n) {
  const dvec3 a = glm::abs(n);
  const dvec3 axis = a.x <= a.y && a.x <= a.z ? dvec3(1, 0, 0) : a.y <= a.z ? dvec3(0, 1, 0) : dvec3(0, 0, 1);
  return glm::normalize(cross(n, axis));
}

void add_rim(OutwardMap& map, const ConvexHull& hull, std::span<const dvec3> points, std::span<const dvec3> outwards) {
  const auto on_rim = [&](const dvec3& d) { return std::abs(outwardness(outwards, d)) <= kOnRim; };
  const auto outermost = [&](const dvec3& d) {
    Index best = 0;
    for (Index k = 1; k < hull.vertices.size(); ++k) {
      if (dot(points[hull.vertices[k]] - points[hull.vertices[best]], d) > 0) best = k;
    }
    return best;
  };
  for (const dvec3& n : outwards) {
    RimCircle circle(n, perpendicular(n));
    const auto add = [&](const dvec3& c, auto&& is_corner) {
      const double length = glm::length(c);
      if (length < kOnRim) return;
      for (const dvec3& d : {c / length, -c / length}) {
        if (on_rim(d) && is_corner(d)) circle.add(d);
      }
    };
    for (const HullEdge& e : hull.edges) {
      add(cross(e.along, n),
          [&](const dvec3& d) { return dot(e.limits[0], d) >= -kOnRim && dot(e.limits[1], d) >= -kOnRim; });
    }
    for (const dvec3& m : outwards) add(cross(m, n), [](const dvec3&) { return true; });

    const std::vector<double> corners = circle.corners();
    const std::size_t arcs = corners.size() - 1;
    std::vector<Index> face(arcs, kNone);
    const auto face_at = [&](std::size_t corner) {
      if (face[corner % arcs] == kNone) {
        face[corner % arcs] = Index(map.faces.size());
        const dvec3 d = circle.at(corners[corner]);
        map.faces.push_back({d, dot(points[hull.vertices[outermost(d)]], d)});
      }
      return face[corner % arcs];
    };
    for (std::size_t k = 0; k < arcs; ++k) {
      const dvec3 half_way = circle.at(0.5 * (corners[k] + corners[k + 1]));
      if (!on_rim(half_way)) continue;
      const Index vertex = outermost(half_way);
      map.edges.push_back({{vertex, vertex},
                           {face_at(k), face_at(k + 1)},
                           n,
                           {cross(n, circle.at(corners[k])), cross(circle.at(corners[k + 1]), n)}});
    }
  }
}

}  // namespace

OutwardMap outward_map(const ConvexHull& hull, std::span<const dvec3> points, std::span<const dvec3> outwards) {
  OutwardMap map;
  std::vector<Index> place(hull.faces.size());
  const auto leads_out = [&](Index f) {
    return outwards.empty() || outwardness(outwards, hull.faces[f].normal) >= -kOnRim;
  };
  const auto add_faces = [&](bool outward) {
    for (Index f = 0; f < hull.faces.size(); ++f) {
      if (leads_out(f) != outward) continue;
      place[f] = Index(map.faces.size());
      map.faces.push_back(hull.faces[f]);
    }
  };
  // A segment's circle is outward in part, whatever the faces that stand for its ends.
  const auto is_outward = [&](const HullEdge& e) {
    return hull.dimension < 2 || leads_out(e.faces[0]) || leads_out(e.faces[1]);
  };
  const auto add_edges = [&](bool outward) {
    for (const HullEdge& e : hull.edges) {
      if (is_outward(e) == outward) map.edges.push_back(e);
    }
  };
  add_faces(true);
  add_edges(true);
  const std::size_t own_edges = map.edges.size();
  if (!outwards.empty()) add_rim(map, hull, points, outwards);
  const std::size_t rim_edges = map.edges.size();
  map.outward_faces = Index(map.faces.size()), map.outward_edges = Index(map.edges.size());
  add_faces(false);
  add_edges(false);
  for (std::size_t i = 0; i < map.edges.size(); ++i) {
    if (i >= own_edges && i < rim_edges) continue;  // these count places already
    for (Index& f : map.edges[i].faces) f = place[f];
  }
  return map;
}

}  // namespace farfeel::collision
