#include "haptic_core/collision/convex_pieces.h"

#include <algorithm>
#include <limits>

namespace farfeel::collision {
namespace {

constexpr double kSameDirection = 1e-9;  // sine: outward normals closer than this count once
constexpr double kClosed = 1e-6;         // of the area: a closed surface's area vectors add to less

std::uint32_t padded(std::uint32_t count) {
  return (count + 3) & ~3U;
}

}  // namespace

ConvexPieces::ConvexPieces(const geometry::HapticSurface& surface)
    : ConvexPieces(surface.coarse, surface.triangle_piece, surface.piece_count) {}

ConvexPieces::ConvexPieces(const geometry::TriangleMesh& mesh, std::span<const std::uint32_t> triangle_piece,
                           std::uint32_t count)
    : centre_O(0) {
  const geometry::Box around = geometry::bounding_box(mesh);
  if (around.is_empty()) return;
  centre_O = around.centre();
  std::vector<std::vector<std::uint32_t>> triangles_of(count);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) triangles_of[triangle_piece[t]].push_back(t);

  for (const auto& triangles : triangles_of) {
    std::vector<std::uint32_t> corners;
    std::vector<glm::dvec3> points, directions;
    glm::dvec3 area(0);
    double total = 0;
    for (const std::uint32_t t : triangles) {
      const auto& [a, b, c] = mesh.triangles[t];
      corners.insert(corners.end(), {a, b, c});
      const glm::dvec3 twice =
          glm::cross(mesh.positions_O[b] - mesh.positions_O[a], mesh.positions_O[c] - mesh.positions_O[a]);
      if (!(glm::length(twice) > 0)) continue;
      area += twice, total += glm::length(twice);
      directions.push_back(glm::normalize(twice));
    }
    if (corners.empty()) corners.push_back(0);
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    for (const std::uint32_t c : corners) points.push_back(mesh.positions_O[c]);
    if (glm::length(area) <= kClosed * total) directions.clear();
    add_piece(points, directions);
  }
}

std::uint32_t ConvexPieces::add_piece(std::span<const glm::dvec3> points_O, std::span<const glm::dvec3> outwards_O) {
  std::vector<glm::dvec3> points(points_O.begin(), points_O.end());
  for (glm::dvec3& p : points) p -= centre_O;
  const ConvexHull hull = convex_hull(points);

  std::vector<glm::dvec3> outwards;
  for (const glm::dvec3& n : outwards_O) {
    const auto known = [&](const glm::dvec3& m) {
      return glm::dot(n, m) > 0 && glm::length(glm::cross(n, m)) < kSameDirection;
    };
    if (std::none_of(outwards.begin(), outwards.end(), known)) outwards.push_back(n);
  }
  OutwardMap map = outward_map(hull, points, outwards);

  ConvexPiece piece{};
  piece.first_number = std::uint32_t(numbers.size());
  std::vector<glm::dvec3> corners, normals;
  for (const std::uint32_t i : hull.vertices) corners.push_back(points[i]);
  piece.vertex_count = add_triples(corners, corners.back());
  piece.outward_count = add_triples(outwards, outwards.empty() ? glm::dvec3(0) : outwards.back());
  for (const HullFace& f : map.faces) normals.push_back(f.normal);
  piece.face_count = add_triples(normals, glm::dvec3(0));
  for (const HullFace& f : map.faces) numbers.push_back(f.offset_m);
  numbers.resize(numbers.size() + piece.face_count - map.faces.size(), std::numeric_limits<double>::infinity());
  piece.outward_face_count = map.outward_faces;

  geometry::Box around;
  for (const glm::dvec3& p : corners) around.include(p), box.include(p);
  boxes.push_back(around);
  piece.first_edge = std::uint32_t(edges.size());
  piece.edge_count = std::uint32_t(map.edges.size());
  piece.outward_edge_count = map.outward_edges;
  edges.insert(edges.end(), map.edges.begin(), map.edges.end());
  for (const HullEdge& e : map.edges) edge_faces.push_back(e.faces);
  piece.first_edge_at = std::uint32_t(edges_at.size());
  add_edges_at(map.edges, std::uint32_t(hull.vertices.size()));
  pieces.push_back(piece);
  return size() - 1;
}

// First where each vertex's list starts, then the lists; arcs of the rim, which stand at one vertex, are in none.
void ConvexPieces::add_edges_at(const std::vector<HullEdge>& of_piece, std::uint32_t vertices) {
  std::vector<std::vector<std::uint32_t>> lists(vertices);
  for (std::uint32_t i = 0; i < of_piece.size(); ++i) {
    const auto [a, b] = of_piece[i].ends;
    if (a != b) lists[a].push_back(i), lists[b].push_back(i);
  }
  std::uint32_t start = vertices + 1;
  for (const auto& list : lists) edges_at.push_back(start), start += std::uint32_t(list.size());
  edges_at.push_back(start);
  for (const auto& list : lists) edges_at.insert(edges_at.end(), list.begin(), list.end());
}

std::uint32_t ConvexPieces::add_triples(const std::vector<glm::dvec3>& values, const glm::dvec3& filler) {
  const std::uint32_t count = padded(std::uint32_t(values.size()));
  for (int axis = 0; axis < 3; ++axis) {
    for (std::uint32_t i = 0; i < count; ++i) numbers.push_back(i < values.size() ? values[i][axis] : filler[axis]);
  }
  return count;
}

}  // namespace farfeel::collision
