#include "haptic_core/collision/convex_hull.h"

#include <gtest/gtest.h>

#include <random>

namespace farfeel::collision {
namespace {

using glm::dvec3;
using Points = std::vector<dvec3>;

void expect_outermost(const ConvexHull& hull, const Points& points, double tolerance = 1e-12) {
  for (const HullFace& f : hull.faces) {
    EXPECT_NEAR(glm::length(f.normal), 1, 1e-14);
    for (const dvec3& p : points) EXPECT_LE(glm::dot(f.normal, p), f.offset_m + tolerance);
  }
  for (const HullEdge& edge : hull.edges) {
    const dvec3 a = points[hull.vertices[edge.ends[0]]], b = points[hull.vertices[edge.ends[1]]];
    EXPECT_NEAR(glm::length(edge.along), 1, 1e-14);
    EXPECT_NEAR(glm::length(glm::cross(edge.along, a - b)), 0, tolerance);
    if (hull.dimension < 2) continue;
    // Half-way on its arc the edge is outermost; the limits admit that direction and not its reverse.
    const dvec3 n = hull.faces[edge.faces[0]].normal, m = hull.faces[edge.faces[1]].normal;
    const dvec3 half_way = glm::normalize(glm::dot(n, m) > 0 ? n + m : edge.limits[0] + edge.limits[1]);
    EXPECT_NEAR(glm::dot(half_way, edge.along), 0, 1e-9);
    for (const dvec3& p : points) EXPECT_LE(glm::dot(half_way, p - a), tolerance);
    EXPECT_GT(glm::dot(half_way, edge.limits[0]), 0);
    EXPECT_GT(glm::dot(half_way, edge.limits[1]), 0);
    for (const std::uint32_t f : edge.faces) {
      EXPECT_NEAR(glm::dot(hull.faces[f].normal, a), hull.faces[f].offset_m, tolerance);
    }
  }
}

TEST(ConvexHull, OfACubeHasSixFacesAndTwelveEdges) {
  Points points;
  for (int i = 0; i < 27; ++i) points.emplace_back(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
  const ConvexHull hull = convex_hull(points);
  EXPECT_EQ(hull.dimension, 3);
  EXPECT_EQ(hull.vertices.size(), 8U);
  EXPECT_EQ(hull.faces.size(), 6U);
  EXPECT_EQ(hull.edges.size(), 12U);
  expect_outermost(hull, points);
}

TEST(ConvexHull, OfAFlatSquareHasTwoFaces) {
  const Points points = {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 1}, {0.5, 0, 1}};
  const ConvexHull hull = convex_hull(points);
  EXPECT_EQ(hull.dimension, 2);
  EXPECT_EQ(hull.vertices.size(), 4U);
  EXPECT_EQ(hull.faces.size(), 2U);
  EXPECT_EQ(hull.edges.size(), 4U);
  expect_outermost(hull, points);
}

TEST(ConvexHull, OfASegmentAndOfAPoint) {
  const ConvexHull segment = convex_hull(Points{{0, 0, 0}, {1, 2, 3}, {0.5, 1, 1.5}, {0, 0, 0}});
  EXPECT_EQ(segment.dimension, 1);
  EXPECT_EQ(segment.vertices.size(), 2U);
  EXPECT_EQ(segment.edges.size(), 1U);
  EXPECT_EQ(convex_hull(Points{{1, 1, 1}, {1, 1, 1}}).dimension, 0);
  EXPECT_EQ(convex_hull({}).dimension, -1);
}

TEST(ConvexHull, ContainsRandomPointsAtEveryScale) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 60; ++round) {
    const double scale = std::pow(10.0, round % 7 - 3);
    Points points;
    for (int i = 0; i < 4 + round; ++i) points.push_back(scale * dvec3(normal(random), normal(random), normal(random)));
    const ConvexHull hull = convex_hull(points);
    EXPECT_EQ(hull.dimension, 3);
    expect_outermost(hull, points, 1e-12 * scale);
    EXPECT_LE(hull.faces.size(), 2 * hull.vertices.size() - 4);
  }
}

// Many points in each face: which side they are on is in doubt for all of them.
TEST(ConvexHull, OfALatticeIsACube) {
  for (const double scale : {1e-3, 0.1, 7.0}) {
    Points points;
    for (int i = 0; i < 343; ++i) points.emplace_back(glm::vec3(scale * dvec3(i % 7, i / 7 % 7, i / 49)));
    const ConvexHull hull = convex_hull(points);
    EXPECT_EQ(hull.vertices.size(), 8U);
    EXPECT_EQ(hull.faces.size(), 6U);
    EXPECT_EQ(hull.edges.size(), 12U);
    expect_outermost(hull, points, 1e-12 * scale);
  }
}

// Its points stand on circles, so that four at a time are nearly in a plane.
TEST(ConvexHull, OfABallOfRingsHasAllItsPoints) {
  constexpr int kSides = 40, kRows = 21;
  Points points;
  for (int i = 0; i < kSides * kRows; ++i) {
    const double up = 3.14159265358979 * (i / kSides + 0.5) / kRows,
                 around = 2 * 3.14159265358979 * (i % kSides) / kSides;
    points.emplace_back(std::sin(up) * std::cos(around), std::sin(up) * std::sin(around), -std::cos(up));
  }
  const ConvexHull hull = convex_hull(points);
  EXPECT_EQ(hull.vertices.size(), points.size());
  expect_outermost(hull, points, 1e-12);
}

// A tilted polygon in single precision is a sliver of a solid, thinner than a ten-millionth of its size.
TEST(ConvexHull, OfARoundedPolygonIsSound) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int round = 0; round < 50; ++round) {
    const dvec3 u = glm::normalize(dvec3(uniform(random), uniform(random), uniform(random)));
    const dvec3 v = glm::normalize(glm::cross(u, dvec3(uniform(random), uniform(random), uniform(random))));
    Points points;
    for (int i = 0; i < 12; ++i) points.emplace_back(glm::vec3(std::cos(0.5 * i) * u + std::sin(0.5 * i) * v));
    const ConvexHull hull = convex_hull(points);
    EXPECT_GE(hull.vertices.size(), 10U);
    expect_outermost(hull, points, 1e-12);
  }
}

}  // namespace
}  // namespace farfeel::collision
