#include "tests/bench/collision_cases.h"

#include <cmath>
#include <random>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::bench {
namespace {

using glm::dvec3;
using Points = std::vector<dvec3>;

Points box(const dvec3& half) {
  Points points;
  for (int i = 0; i < 8; ++i) {
    points.push_back(half * dvec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  }
  return points;
}
Points polygon(int corners, double radius) {
  Points points;
  for (int i = 0; i < corners; ++i) {
    const double a = 2 * M_PI * (i + 0.5) / corners;
    points.push_back(radius * dvec3(std::cos(a), std::sin(a), 0));
  }
  return points;
}
Points moved(Points points, const dvec3& by, const dvec3& turn = dvec3(0)) {
  const auto R = spatial::rotation_from_vector(turn);
  for (dvec3& p : points) p = R * p + by;
  return points;
}

class Cases {
 public:
  void add(const std::string& what, Points A, Points B) {
    for (const double scale : {1e-3, 1.0, 1e3}) {
      Points a = A, b = B;
      for (dvec3& p : a) p *= scale;
      for (dvec3& p : b) p *= scale;
      add_one(what, a, b);
    }
  }
  void add_one(const std::string& what, const Points& A, const Points& B) {
    double size = 0;
    for (const Points* points : {&A, &B}) {
      for (const dvec3& p : *points) size = std::max(size, glm::distance(p, points->front()));
    }
    CollisionCase c{what, {A, {}, {}}, {B, {}, {}}, size, 0};
    c.distance_m = support::exact_proximity(c.A, c.B).distance_m;
    all.push_back(std::move(c));
  }
  std::vector<CollisionCase> all;
};

}  // namespace

std::vector<CollisionCase> degenerate_cases() {
  Cases cases;
  const Points cube = box({1, 1, 1}), slab = box({2, 2, 0.01}), needle = box({3, 1e-3, 1e-3}),
               plate = box({1, 1, 1e-7});
  const Points square = polygon(4, 1), triangle = polygon(3, 1), octagon = polygon(8, 1);
  const Points segment = {{-1, 0, 0}, {1, 0, 0}}, point = {{0, 0, 0}};
  const std::vector<std::pair<std::string, Points>> shapes = {
      {"cube", cube},         {"slab", slab},       {"needle", needle},   {"plate", plate}, {"square", square},
      {"triangle", triangle}, {"octagon", octagon}, {"segment", segment}, {"point", point}};
  // Every shape on every other: coincident, touching along an axis, one inside the other, far away.
  for (const auto& [a, A] : shapes) {
    for (const auto& [b, B] : shapes) {
      cases.add(a + " at " + b, A, B);
      cases.add(a + " on top of " + b, A, moved(B, {0, 0, 1}));
      cases.add(a + " shifted in plane of " + b, A, moved(B, {0.5, 0.25, 0}));
    }
  }
  for (const double gap : {0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6}) {
    cases.add("faces touch", cube, moved(cube, {0.3, 0.2, 2 + gap}));
    cases.add("edges touch, parallel", cube, moved(cube, {2 + gap, 0, 2 + gap}));
    cases.add("corners touch", cube, moved(cube, {2 + gap, 2 + gap, 2 + gap}));
    cases.add("edges cross", cube, moved(moved(cube, {0, 0, 0}, {0, 0, M_PI / 4}), {1 + std::sqrt(2) + gap, 0, 0}));
    cases.add("flats touch", square, moved(octagon, {0.1, 0, gap}));
    cases.add("nearly parallel flats", square, moved(square, {0, 0, 0.1}, {1e-9, gap, 0}));
    cases.add("tilted slivers", plate, moved(plate, {0, 0, gap}, {1e-7, 0, 0}));
  }
  for (const double away : {10.0, 1e3, 1e6, 1e9}) {
    cases.add("far away", cube, moved(cube, {away, 0.3, 0}));
    cases.add("far away, turned", cube, moved(cube, {0.1 * away, away, 0}, {0.3, 0.2, 0.1}));
    cases.add_one("both far from the origin", moved(cube, {away, away, 0}),
                  moved(cube, {away + 1.5, away, 0}, {0.3, 0.2, 0.1}));
  }
  return std::move(cases.all);
}

std::vector<CollisionCase> lattice_cases(std::size_t count) {
  std::mt19937 random(2004);
  std::uniform_int_distribution<int> cell(0, 3), corners(1, 8);
  Cases cases;
  while (cases.all.size() < count) {
    Points A, B;
    const int n = corners(random), m = corners(random);
    for (int i = 0; i < n; ++i) A.emplace_back(cell(random), cell(random), cell(random));
    for (int i = 0; i < m; ++i) B.emplace_back(cell(random), cell(random), cell(random));
    cases.add_one("lattice " + std::to_string(cases.all.size()), A, moved(B, {cell(random), cell(random), 0}));
  }
  return std::move(cases.all);
}

}  // namespace farfeel::bench
