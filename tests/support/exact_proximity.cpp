#include "tests/support/exact_proximity.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfeel::support {
namespace {

using glm::cross;
using glm::dot;
using glm::dvec3;
using Vectors = std::vector<dvec3>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Edge = std::array<std::uint32_t, 2>;
using Triangle = std::array<std::uint32_t, 3>;

// Every pair and every triple, unless the hull says which.
struct Features {
  std::vector<Edge> edges;
  std::vector<Triangle> triangles;

  explicit Features(const PointHull& h) : triangles(h.triangles) {
    const auto n = std::uint32_t(h.points.size());
    if (triangles.empty()) {
      for (std::uint32_t i = 0; i < n; ++i) {
        for (std::uint32_t j = i + 1; j < n; ++j) {
          edges.push_back({i, j});
          for (std::uint32_t k = j + 1; k < n; ++k) triangles.push_back({i, j, k});
        }
      }
      return;
    }
    for (const auto& [i, j, k] : triangles) {
      for (const Edge& e : {Edge{i, j}, Edge{j, k}, Edge{k, i}})
        edges.push_back({std::min(e[0], e[1]), std::max(e[0], e[1])});
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  }
};

Vectors directions(const PointHull& h, const Features& f) {
  Vectors all;
  for (const auto& [i, j] : f.edges) all.push_back(h.points[j] - h.points[i]);
  return all;
}

void add_normals(Vectors& axes, const PointHull& h, const Features& f) {
  for (const auto& [i, j, k] : f.triangles) {
    const dvec3 u = h.points[j] - h.points[i], v = h.points[k] - h.points[i], n = cross(u, v);
    const double length = glm::length(n);
    if (length <= 1e-10 * glm::length(u) * glm::length(v)) continue;
    axes.push_back(n / length), axes.push_back(-n / length);
  }
}

void add_crosses(Vectors& axes, const Vectors& a, const Vectors& b) {
  for (const dvec3& u : a) {
    for (const dvec3& v : b) {
      const dvec3 n = cross(u, v);
      const double length = glm::length(n);
      if (length <= 1e-10 * glm::length(u) * glm::length(v)) continue;
      axes.push_back(n / length), axes.push_back(-n / length);
    }
  }
}

double outwardness(const Vectors& outwards, const dvec3& d) {
  double best = outwards.empty() ? 1 : -1;
  for (const dvec3& n : outwards) best = std::max(best, dot(n, d));
  return best;
}

struct Offset {
  double length;
  dvec3 from_a;
};

Offset point_to_segment(const dvec3& p, const dvec3& a, const dvec3& b) {
  const dvec3 e = b - a;
  const double length = dot(e, e), t = length > 0 ? std::clamp(dot(p - a, e) / length, 0.0, 1.0) : 0;
  const dvec3 offset = a + t * e - p;
  return {glm::length(offset), offset};
}

// The interior of the triangle only; its border belongs to the segments.
Offset point_to_triangle(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  const dvec3 n = cross(b - a, c - a);
  const double area = dot(n, n);
  const double wa = dot(cross(b - p, c - p), n), wb = dot(cross(c - p, a - p), n), wc = dot(cross(a - p, b - p), n);
  if (!(area > 0) || wa < 0 || wb < 0 || wc < 0) return {kInfinity, {}};
  const dvec3 offset = n * (dot(a - p, n) / area);
  return {glm::length(offset), offset};
}

// Interiors of both; their ends belong to point_to_segment.
Offset segment_to_segment(const dvec3& a, const dvec3& b, const dvec3& c, const dvec3& d) {
  const dvec3 u = b - a, v = d - c, w = c - a, n = cross(u, v);
  const double sine = dot(n, n);
  if (!(sine > 0)) return {kInfinity, {}};
  const double s = dot(cross(w, v), n) / sine, t = dot(cross(w, u), n) / sine;
  if (s < 0 || s > 1 || t < 0 || t > 1) return {kInfinity, {}};
  const dvec3 offset = n * (dot(w, n) / sine);
  return {glm::length(offset), offset};
}

Offset features_apart(const PointHull& A, const Features& of_a, const PointHull& B, const Features& of_b) {
  Offset best{kInfinity, {}};
  const auto keep = [&](const Offset& o, double sign) {
    if (o.length < best.length) best = {o.length, sign * o.from_a};
  };
  const auto points_of_one = [&](const Vectors& P, const Vectors& Q, const Features& of_q, double sign) {
    for (const dvec3& p : P) {
      if (Q.size() == 1) keep({glm::length(Q[0] - p), Q[0] - p}, sign);
      for (const auto& [i, j] : of_q.edges) keep(point_to_segment(p, Q[i], Q[j]), sign);
      for (const auto& [i, j, k] : of_q.triangles) keep(point_to_triangle(p, Q[i], Q[j], Q[k]), sign);
    }
  };
  points_of_one(A.points, B.points, of_b, 1);
  points_of_one(B.points, A.points, of_a, -1);
  for (const auto& [i, j] : of_a.edges) {
    for (const auto& [k, l] : of_b.edges)
      keep(segment_to_segment(A.points[i], A.points[j], B.points[k], B.points[l]), 1);
  }
  return best;
}

}  // namespace

double overlap_along(const PointHull& A, const PointHull& B, const dvec3& d) {
  double most = -kInfinity, least = kInfinity;
  for (const dvec3& a : A.points) most = std::max(most, dot(a, d));
  for (const dvec3& b : B.points) least = std::min(least, dot(b, d));
  return most - least;
}

ExactProximity exact_proximity(const PointHull& A, const PointHull& B) {
  const Features of_a(A), of_b(B);
  const Vectors ea = directions(A, of_a), eb = directions(B, of_b), xyz = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Vectors axes = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  add_normals(axes, A, of_a);
  add_normals(axes, B, of_b);
  add_crosses(axes, ea, eb);
  add_crosses(axes, ea, xyz);
  add_crosses(axes, eb, xyz);
  for (const Vectors* outwards : {&A.outwards, &B.outwards}) {
    add_crosses(axes, ea, *outwards);
    add_crosses(axes, eb, *outwards);
  }
  add_crosses(axes, A.outwards, B.outwards);

  double plain = kInfinity, restricted = kInfinity;
  dvec3 plain_d(0), restricted_d(0);
  for (const dvec3& d : axes) {
    const double p = overlap_along(A, B, d);
    if (p < plain) plain = p, plain_d = d;
    if (p < restricted && outwardness(A.outwards, d) >= -1e-9 && outwardness(B.outwards, -d) >= -1e-9) {
      restricted = p, restricted_d = d;
    }
  }
  if (plain < 0) {
    const Offset apart = features_apart(A, of_a, B, of_b);
    if (apart.length > 0) return {apart.length, apart.length, true, apart.from_a / apart.length};
  }
  bool faces_one_way = !A.outwards.empty() && !B.outwards.empty();
  for (const dvec3& n : A.outwards) {
    for (const dvec3& m : B.outwards) faces_one_way = faces_one_way && dot(n, m) >= std::cos(glm::radians(10.0));
  }
  const bool plain_will_do = outwardness(A.outwards, plain_d) >= -1e-9 && outwardness(B.outwards, -plain_d) >= -1e-9;
  if (plain_will_do) return {-plain, -plain, true, plain_d};
  if (faces_one_way) return {-plain, -plain, restricted <= plain, plain_d};
  return {-restricted, -plain, true, restricted_d};
}

}  // namespace farfeel::support
