// Incremental: start from four points in general position; for each further point remove the faces that see it and
// close the hole with a fan. The sign of the visibility determinant is what it is in quadruple precision: exact for
// float input.
#include "haptic_core/collision/convex_hull.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

namespace farfeel::collision {
namespace {

__extension__ typedef __float128 Quad;

constexpr double kFlat = 1e-12;       // of the extent: thinner is flat
constexpr double kSamePlane = 1e-11;  // sine between two faces: less is one face

using Points = std::span<const glm::dvec3>;
using Index = std::uint32_t;
using Triangles = std::vector<std::array<Index, 3>>;

// Six volumes of (a, b, c, p): positive when p is on the side the normal of a, b, c points to.
Quad orientation(Points points, Index a, Index b, Index c, Index p) {
  Quad m[3][3];
  const Index row[3] = {b, c, p};
  for (int r = 0; r < 3; ++r) {
    for (int k = 0; k < 3; ++k) m[r][k] = Quad(points[row[r]][k]) - Quad(points[a][k]);
  }
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// Normal of a, b, c, its rounding that of one cross product done in quadruple precision.
glm::dvec3 normal_of(Points points, Index a, Index b, Index c) {
  Quad u[3], v[3];
  for (int k = 0; k < 3; ++k) {
    u[k] = Quad(points[b][k]) - Quad(points[a][k]);
    v[k] = Quad(points[c][k]) - Quad(points[a][k]);
  }
  const Quad n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  Quad largest = 0;
  for (const Quad& x : n) largest = std::max(largest, x < 0 ? -x : x);
  if (!(largest > 0)) return glm::dvec3(0);
  return glm::normalize(glm::dvec3(double(n[0] / largest), double(n[1] / largest), double(n[2] / largest)));
}

double largest_along(Points points, const glm::dvec3& n) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const glm::dvec3& p : points) largest = std::max(largest, glm::dot(n, p));
  return largest;
}

glm::dvec3 any_perpendicular(const glm::dvec3& v) {
  const glm::dvec3 a = glm::abs(v);
  const glm::dvec3 axis = a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                          : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                   : glm::dvec3(0, 0, 1);
  return glm::normalize(glm::cross(v, axis));
}

HullFace face(Points points, const glm::dvec3& normal) {
  return {normal, largest_along(points, normal)};
}

void span_point(ConvexHull& hull, Points points, Index only) {
  hull.dimension = 0;
  hull.vertices = {only};
  for (int k = 0; k < 3; ++k) {
    for (const double sign : {1.0, -1.0}) {
      glm::dvec3 n(0);
      n[k] = sign;
      hull.faces.push_back(face(points, n));
    }
  }
}

void span_segment(ConvexHull& hull, Points points, Index first, Index last) {
  hull.dimension = 1;
  hull.vertices = {first, last};
  const glm::dvec3 along = glm::normalize(points[last] - points[first]);
  const glm::dvec3 u = any_perpendicular(along), v = glm::cross(along, u);
  for (const glm::dvec3& n : {u, v, -u, -v}) hull.faces.push_back(face(points, n));
  hull.edges.push_back({{0, 1}, {0, 0}, along, {}});
}

// Andrew's monotone chain on the plane's two leading axes.
void span_polygon(ConvexHull& hull, Points points, const glm::dvec3& n) {
  hull.dimension = 2;
  const glm::dvec3 size = glm::abs(n);
  const int drop = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const int i = (drop + 1) % 3, j = (drop + 2) % 3;
  std::vector<Index> order(points.size());
  std::iota(order.begin(), order.end(), Index{0});
  const auto before = [&](Index a, Index b) {
    return std::pair(points[a][i], points[a][j]) < std::pair(points[b][i], points[b][j]);
  };
  std::sort(order.begin(), order.end(), before);
  const auto turn = [&](Index a, Index b, Index c) {
    return (Quad(points[b][i]) - points[a][i]) * (Quad(points[c][j]) - points[a][j]) -
           (Quad(points[b][j]) - points[a][j]) * (Quad(points[c][i]) - points[a][i]);
  };
  std::vector<Index> ring;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = ring.size();
    for (const Index p : order) {
      while (ring.size() >= start + 2 && !(turn(ring[ring.size() - 2], ring.back(), p) > 0)) ring.pop_back();
      ring.push_back(p);
    }
    ring.pop_back();
    std::reverse(order.begin(), order.end());
  }
  hull.vertices = ring;
  hull.faces = {face(points, n), face(points, -n)};
  const double side = n[drop] > 0 ? 1 : -1;  // counter-clockwise seen along -n or n
  for (Index k = 0; k < ring.size(); ++k) {
    const Index next = (k + 1) % Index(ring.size());
    const glm::dvec3 along = glm::normalize(points[ring[next]] - points[ring[k]]);
    const glm::dvec3 outward = side * glm::normalize(glm::cross(along, n));
    hull.edges.push_back({{k, next}, {0, 1}, along, {outward, outward}});
  }
}

/// With its plane in double, which tells most points' side at once.
struct Facet {
  std::array<Index, 3> corners;
  glm::dvec3 doubled_normal;
  double doubt_m2;  ///< times a point's distance from the first corner: how far rounding may put the determinant off
  bool removed = false;
};

Facet facet(Points points, std::array<Index, 3> corners) {
  constexpr double kDoubt = 1e-14;  // three times what 30 roundings of half a unit in the last place come to
  const glm::dvec3 u = points[corners[1]] - points[corners[0]], v = points[corners[2]] - points[corners[0]];
  return {corners, glm::cross(u, v), kDoubt * glm::length(u) * glm::length(v)};
}

/// Whether orientation() is more than the noise; in quadruple precision only where double leaves a doubt.
bool is_seen_from(Points points, const Facet& f, Index p, Quad noise) {
  const glm::dvec3 way = points[p] - points[f.corners[0]];
  const double over = glm::dot(f.doubled_normal, way) - static_cast<double>(noise);
  if (std::abs(over) > f.doubt_m2 * glm::length(way)) return over > 0;
  return orientation(points, f.corners[0], f.corners[1], f.corners[2], p) > noise;
}

Triangles solid_triangles(Points points, std::array<Index, 4> seed, Quad noise) {
  if (orientation(points, seed[0], seed[1], seed[2], seed[3]) > 0) std::swap(seed[1], seed[2]);
  const auto [a, b, c, d] = seed;
  std::vector<Facet> facets = {facet(points, {a, b, c}), facet(points, {a, c, d}), facet(points, {a, d, b}),
                               facet(points, {b, d, c})};
  std::map<std::pair<Index, Index>, int> rim;
  for (Index p = 0; p < points.size(); ++p) {
    rim.clear();
    for (Facet& f : facets) {
      if (!is_seen_from(points, f, p, noise)) continue;
      f.removed = true;
      for (int k = 0; k < 3; ++k) rim[{f.corners[k], f.corners[(k + 1) % 3]}] = 1;
    }
    std::erase_if(facets, [](const Facet& f) { return f.removed; });
    for (const auto& [edge, count] : rim) {
      if (!rim.contains({edge.second, edge.first})) facets.push_back(facet(points, {edge.first, edge.second, p}));
    }
  }
  Triangles triangles;
  for (const Facet& f : facets) triangles.push_back(f.corners);
  return triangles;
}

bool is_same_direction(const glm::dvec3& n, const glm::dvec3& m) {
  return glm::dot(n, m) > 0 && glm::length(glm::cross(n, m)) < kSamePlane;
}

// The corners at which three or more faces meet; the others lie within a face or an edge.
std::vector<Index> extreme_points(Points points, const Triangles& triangles) {
  std::map<Index, std::vector<glm::dvec3>> normals_at;
  for (const auto& t : triangles) {
    const glm::dvec3 n = normal_of(points, t[0], t[1], t[2]);
    if (n == glm::dvec3(0)) continue;
    for (const Index corner : t) {
      auto& normals = normals_at[corner];
      const auto same = [&](const glm::dvec3& m) { return is_same_direction(n, m); };
      if (std::none_of(normals.begin(), normals.end(), same)) normals.push_back(n);
    }
  }
  std::vector<Index> extreme;
  for (const auto& [corner, normals] : normals_at) {
    if (normals.size() >= 3) extreme.push_back(corner);
  }
  return extreme;
}

/// The faces of a hull, found by their normals' directions: in cells, of which one normal is near to several only at
/// their borders.
class FacesByNormal {
 public:
  void add(const glm::dvec3& n, Index face) { faces_[cell(n)].push_back(face); }
  /// The first that faces the same direction.
  [[nodiscard]] std::optional<Index> find(const glm::dvec3& n, const ConvexHull& hull) const {
    constexpr double kNear = 10 * kSamePlane;
    std::optional<Index> first;
    const Cell low = cell(n - kNear), high = cell(n + kNear);
    for (Cell at = low; at[0] <= high[0]; ++at[0]) {
      for (at[1] = low[1]; at[1] <= high[1]; ++at[1]) {
        for (at[2] = low[2]; at[2] <= high[2]; ++at[2]) {
          const auto found = faces_.find(at);
          if (found == faces_.end()) continue;
          for (const Index f : found->second) {
            if ((!first || f < *first) && is_same_direction(hull.faces[f].normal, n)) first = f;
          }
        }
      }
    }
    return first;
  }

 private:
  using Cell = std::array<std::int32_t, 3>;
  static Cell cell(const glm::dvec3& n) {
    constexpr double kCellsAUnit = 1000;
    Cell at{};
    for (int k = 0; k < 3; ++k)
      at[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(std::floor(kCellsAUnit * n[k]));
    return at;
  }
  std::map<Cell, std::vector<Index>> faces_;
};

void span_solid(ConvexHull& hull, Points points, const Triangles& triangles) {
  hull.dimension = 3;
  FacesByNormal known;
  const auto face_of = [&](const glm::dvec3& n) {
    if (const auto same = known.find(n, hull)) return *same;
    known.add(n, Index(hull.faces.size()));
    hull.faces.push_back(face(points, n));
    return Index(hull.faces.size() - 1);
  };
  std::map<std::pair<Index, Index>, Index> face_left_of;
  for (const auto& t : triangles) {
    const glm::dvec3 n = normal_of(points, t[0], t[1], t[2]);
    if (n == glm::dvec3(0)) continue;
    const Index f = face_of(n);
    for (int k = 0; k < 3; ++k) face_left_of[{t[k], t[(k + 1) % 3]}] = f;
  }
  std::map<Index, Index> place;
  const auto place_of = [&](Index p) {
    const auto [it, fresh] = place.try_emplace(p, Index(hull.vertices.size()));
    if (fresh) hull.vertices.push_back(p);
    return it->second;
  };
  for (const auto& [edge, left] : face_left_of) {
    const auto right = face_left_of.find({edge.second, edge.first});
    if (edge.first > edge.second || right == face_left_of.end() || right->second == left) continue;
    const glm::dvec3 n = hull.faces[left].normal, m = hull.faces[right->second].normal;
    const glm::dvec3 along = glm::normalize(points[edge.second] - points[edge.first]);
    // From m to n the arc turns about `along`: the directions between are left of m and right of n.
    hull.edges.push_back({{place_of(edge.first), place_of(edge.second)},
                          {left, right->second},
                          along,
                          {glm::normalize(glm::cross(along, n)), glm::normalize(glm::cross(m, along))}});
  }
}

}  // namespace

ConvexHull convex_hull(Points points) {
  ConvexHull hull;
  if (points.empty()) return hull;
  // Four points in general position, each the farthest from what the earlier ones span.
  const auto farthest = [&](auto&& distance) {
    Index best = 0;
    for (Index p = 1; p < points.size(); ++p) {
      if (distance(points[p]) > distance(points[best])) best = p;
    }
    return best;
  };
  const Index a = farthest([&](const glm::dvec3& p) { return glm::distance(p, points[0]); });
  const Index b = farthest([&](const glm::dvec3& p) { return glm::distance(p, points[a]); });
  const double extent = glm::distance(points[a], points[b]);
  if (!(extent > 0)) return span_point(hull, points, a), hull;
  const glm::dvec3 along = (points[b] - points[a]) / extent;
  const auto off_line = [&](const glm::dvec3& p) { return glm::length(glm::cross(p - points[a], along)); };
  const Index c = farthest(off_line);
  if (off_line(points[c]) <= kFlat * extent) return span_segment(hull, points, a, b), hull;
  const glm::dvec3 n = normal_of(points, a, b, c);
  const auto off_plane = [&](const glm::dvec3& p) { return std::abs(glm::dot(p - points[a], n)); };
  const Index d = farthest(off_plane);
  if (off_plane(points[d]) <= kFlat * extent) return span_polygon(hull, points, n), hull;
  const Quad noise = Quad(extent) * Quad(extent) * Quad(extent) * Quad(1e-31);
  const Triangles triangles = solid_triangles(points, {a, b, c, d}, noise);
  const std::vector<Index> extreme = extreme_points(points, triangles);
  if (extreme.size() < points.size() && extreme.size() >= 4) {
    std::vector<glm::dvec3> corners;
    for (const Index i : extreme) corners.push_back(points[i]);
    hull = convex_hull(corners);
    for (Index& i : hull.vertices) i = extreme[i];
    return hull;
  }
  span_solid(hull, points, triangles);
  return hull;
}

}  // namespace farfeel::collision
