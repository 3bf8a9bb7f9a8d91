// Polygons of every kind that files hold: the triangles cover the polygon, turn as it does, and meet its neighbours
// along whole edges.
#include "codecs/mesh/polygon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>

namespace farfeel::codecs {
namespace {

using Points = std::vector<glm::dvec2>;

double cross(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

double area_of(const Points& outline) {
  double twice = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) twice += cross(outline[i], outline[(i + 1) % outline.size()]);
  return twice / 2;
}

/// In space: turned and far from the origin, so that nothing falls on an axis.
std::vector<glm::dvec3> placed(const Points& outline) {
  const glm::dvec3 u = glm::normalize(glm::dvec3(2, 1, -1)), v = glm::normalize(glm::dvec3(0, 1, 1));
  std::vector<glm::dvec3> out;
  for (const glm::dvec2& p : outline) out.push_back(glm::dvec3(5, -7, 3) + p.x * u + p.y * v);
  return out;
}

std::vector<std::uint32_t> all_of(std::size_t count) {
  std::vector<std::uint32_t> corners(count);
  for (std::uint32_t i = 0; i < count; ++i) corners[i] = i;
  return corners;
}

/// As many triangles as there must be, none turned over, together as large as the polygon: so they cover it once. And
/// the edges are those of the outline, each the way it runs, and others twice, to and fro.
void expect_covered(const Points& outline, const std::string& what) {
  SCOPED_TRACE(what);
  std::vector<geometry::Triangle> triangles;
  const auto fault = cut_polygon(placed(outline), all_of(outline.size()), triangles);
  ASSERT_FALSE(fault) << *fault;
  const std::size_t n = outline.size();
  ASSERT_EQ(triangles.size(), n - 2);
  const double whole = area_of(outline);
  double sum = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const geometry::Triangle& t : triangles) {
    const double area = cross(outline[t[1]] - outline[t[0]], outline[t[2]] - outline[t[0]]) / 2;
    EXPECT_GE(area * whole, -1e-9 * whole * whole);
    sum += area;
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}], --edges[{t[(k + 1) % 3], t[k]}];
  }
  EXPECT_NEAR(sum, whole, 1e-9 * std::abs(whole));
  for (std::uint32_t i = 0; i < n; ++i) --edges[{i, (i + 1) % n}], ++edges[{(i + 1) % n, i}];
  for (const auto& [edge, count] : edges) EXPECT_EQ(count, 0) << edge.first << " " << edge.second;
}

/// From every corner on, and the other way round.
void expect_covered_from_everywhere(Points outline, const std::string& what) {
  for (int way = 0; way < 2; ++way) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      expect_covered(outline, what + " from " + std::to_string(i));
      std::rotate(outline.begin(), outline.begin() + 1, outline.end());
    }
    std::reverse(outline.begin(), outline.end());
  }
}

Points ring(std::size_t count, const std::function<double(std::size_t)>& radius) {
  Points out;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    out.push_back(radius(i) * glm::dvec2(std::cos(angle), std::sin(angle)));
  }
  return out;
}

TEST(PolygonTest, ShapesWhoseFirstCornerDoesNotSeeTheOthers) {
  expect_covered_from_everywhere({{0, 0}, {1, 0}, {0.2, 0.2}, {0, 1}}, "arrow");
  expect_covered_from_everywhere({{0, 0}, {60, 0}, {60, 40}, {45, 40}, {45, 10}, {15, 10}, {15, 40}, {0, 40}}, "U");
  expect_covered_from_everywhere({{20, 0},
                                  {40, 0},
                                  {40, 20},
                                  {60, 20},
                                  {60, 40},
                                  {40, 40},
                                  {40, 60},
                                  {20, 60},
                                  {20, 40},
                                  {0, 40},
                                  {0, 20},
                                  {20, 20}},
                                 "plus");
  expect_covered_from_everywhere(ring(10, [](std::size_t i) { return i % 2 == 0 ? 30.0 : 11.0; }), "star");
  expect_covered_from_everywhere(ring(6, [](std::size_t) { return 1.0; }), "hexagon");
}

TEST(PolygonTest, CornersInLineAreAllUsed) {
  expect_covered_from_everywhere({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {0, 1}}, "one long side");
  expect_covered_from_everywhere({{0, 0}, {1, 0}, {2, 0}, {1, 1}}, "a triangle with a corner on its side");
  expect_covered_from_everywhere({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}, "every side");
}

TEST(PolygonTest, AHoleThatABridgeReaches) {
  const Points outer{{0, 0}, {10, 0}, {10, 10}, {0, 10}}, hole{{3, 3}, {3, 7}, {7, 7}, {7, 3}};
  Points keyhole = outer;
  keyhole.push_back(outer[0]);
  keyhole.insert(keyhole.end(), hole.begin(), hole.end());
  keyhole.push_back(hole[0]);
  std::rotate(keyhole.begin(), keyhole.begin() + 1, keyhole.end());
  expect_covered_from_everywhere(keyhole, "frame");
  Points two{{0, 0}, {20, 0}, {20, 10}, {0, 10}, {0, 0},  {3, 3},  {3, 7}, {7, 7},
             {7, 3}, {12, 3}, {12, 7},  {17, 7}, {17, 3}, {12, 3}, {7, 3}, {3, 3}};
  expect_covered_from_everywhere(two, "two holes in a row");
}

TEST(PolygonTest, CombsAndSpirals) {
  for (const std::size_t teeth : {2U, 5U, 300U}) {
    Points comb{{static_cast<double>(2 * teeth - 1), 0}};
    for (std::size_t i = teeth; i-- > 0;) {
      const auto x = static_cast<double>(2 * i);
      for (const glm::dvec2 p : {glm::dvec2(x + 1, 5), glm::dvec2(x, 5)}) comb.push_back(p);
      if (i > 0) comb.emplace_back(x, 1), comb.emplace_back(x - 1, 1);
    }
    comb.emplace_back(0, 0);
    expect_covered(comb, "comb");
  }
  Points spiral;
  constexpr int kSteps = 200;
  for (int i = 0; i <= kSteps; ++i)
    spiral.emplace_back((1 + 0.1 * i) * std::cos(0.2 * i), (1 + 0.1 * i) * std::sin(0.2 * i));
  for (int i = kSteps; i >= 0; --i)
    spiral.emplace_back((0.2 + 0.1 * i) * std::cos(0.2 * i), (0.2 + 0.1 * i) * std::sin(0.2 * i));
  expect_covered(spiral, "spiral");
}

TEST(PolygonTest, AnythingRoundAPoint) {
  std::mt19937 random(7);
  for (int n = 0; n < 400; ++n) {
    std::uniform_real_distribution<double> radius(0.05, 1);
    const std::size_t corners = 4 + random() % 60;
    expect_covered(ring(corners, [&](std::size_t) { return radius(random); }), "ring " + std::to_string(n));
  }
}

TEST(PolygonTest, AnythingOnAGrid) {
  // Random corners on a small grid, uncrossed by turning stretches round: many in line, many that touch.
  std::mt19937 random(11);
  int covered = 0;
  for (int n = 0; n < 600; ++n) {
    Points outline;
    const std::size_t corners = 5 + random() % 20;
    while (outline.size() < corners) {
      const glm::dvec2 p(random() % 9, random() % 9);
      if (std::find(outline.begin(), outline.end(), p) == outline.end()) outline.push_back(p);
    }
    const auto length = [&](std::size_t i, std::size_t j) {
      return glm::length(outline[i % corners] - outline[j % corners]);
    };
    for (bool shorter = true; shorter;) {
      shorter = false;
      for (std::size_t i = 0; i + 1 < corners; ++i) {
        for (std::size_t j = i + 2; j < corners; ++j) {
          if (length(i, j) + length(i + 1, j + 1) >= length(i, i + 1) + length(j, j + 1) - 1e-9) continue;
          std::reverse(outline.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                       outline.begin() + static_cast<std::ptrdiff_t>(j) + 1);
          shorter = true;
        }
      }
    }
    if (std::abs(area_of(outline)) < 1) continue;
    std::vector<geometry::Triangle> triangles;
    if (cut_polygon(placed(outline), all_of(corners), triangles)) continue;  // it lies on itself: refused
    expect_covered(outline, "grid " + std::to_string(n));
    ++covered;
  }
  EXPECT_GT(covered, 500);
}

TEST(PolygonTest, WhatCrossesItselfIsRefused) {
  const auto is_refused = [](const Points& outline) {
    std::vector<geometry::Triangle> triangles;
    return cut_polygon(placed(outline), all_of(outline.size()), triangles).has_value() && triangles.empty();
  };
  EXPECT_TRUE(is_refused({{0, 0}, {1, 1}, {1, 0}, {0, 1}}));           // a bow tie whose halves are equal
  EXPECT_TRUE(is_refused({{0, 0}, {2, 2}, {2, 0}, {0, 1}}));           // and one whose are not
  EXPECT_TRUE(is_refused({{0, 0}, {4, 0}, {4, 4}, {1, -1}, {0, 4}}));  // a spike through a side
  Points pentagram = ring(5, [](std::size_t) { return 1.0; });
  pentagram = {pentagram[0], pentagram[2], pentagram[4], pentagram[1], pentagram[3]};
  EXPECT_TRUE(is_refused(pentagram));
  Points twice = ring(12, [](std::size_t i) { return 1.0 + (i < 6 ? 0.0 : 0.5); });  // twice round
  for (std::size_t i = 0; i < 12; ++i) {
    const double angle = 4 * std::numbers::pi * static_cast<double>(i) / 12;
    twice[i] = (i < 6 ? 1.0 : 1.5) * glm::dvec2(std::cos(angle), std::sin(angle));
  }
  EXPECT_TRUE(is_refused(twice));
}

TEST(PolygonTest, CornersNeedNotLieInOnePlane) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> bump(-0.1, 0.1);
  for (int n = 0; n < 100; ++n) {
    std::vector<glm::dvec3> positions;
    const std::size_t corners = 5 + random() % 10;
    for (const glm::dvec2& p : ring(corners, [](std::size_t i) { return i % 2 == 0 ? 1.0 : 0.4; }))
      positions.emplace_back(p.x, p.y, bump(random));
    std::vector<geometry::Triangle> triangles;
    ASSERT_FALSE(cut_polygon(positions, all_of(corners), triangles));
    EXPECT_EQ(triangles.size(), corners - 2);
    for (const auto& [a, b, c] : triangles)
      EXPECT_GT(glm::cross(positions[b] - positions[a], positions[c] - positions[a]).z, 0);
  }
  // Bent so much that its outline seems to cross itself from everywhere: a quad may be, whichever diagonal is taken.
  std::vector<geometry::Triangle> triangles;
  EXPECT_FALSE(cut_polygon({{0, 0, 0}, {2, 2, 1}, {2, 0, 0}, {0, 1, 1}}, all_of(4), triangles));
  EXPECT_EQ(triangles.size(), 2U);
}

TEST(PolygonTest, WhatHasNoAreaKeepsItsEdges) {
  std::vector<geometry::Triangle> triangles;
  EXPECT_FALSE(cut_polygon({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, all_of(4), triangles));
  EXPECT_EQ(triangles.size(), 2U);
  triangles.clear();
  EXPECT_FALSE(cut_polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, std::vector<std::uint32_t>{0, 1, 1, 2, 2, 0}, triangles));
  EXPECT_EQ(triangles.size(), 1U) << "a corner named twice in a row is one";
  triangles.clear();
  EXPECT_FALSE(cut_polygon({{0, 0, 0}, {1, 0, 0}}, std::vector<std::uint32_t>{0, 1, 1, 0}, triangles));
  EXPECT_TRUE(triangles.empty());
  EXPECT_FALSE(cut_polygon({{std::nan(""), 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, all_of(4), triangles));
}

TEST(PolygonTest, ManyCornersTakeNoLongTime) {
  expect_covered(ring(8'000, [](std::size_t i) { return i % 2 == 0 ? 1.0 : 0.9; }), "gear");
  expect_covered(ring(100'000, [](std::size_t) { return 1.0; }), "circle");
  std::vector<geometry::Triangle> triangles;
  const Points large = ring(100'000, [](std::size_t i) { return i % 2 == 0 ? 1.0 : 0.9; });
  EXPECT_TRUE(cut_polygon(placed(large), all_of(large.size()), triangles)) << "refused, not endless";
}

}  // namespace
}  // namespace farfeel::codecs
