#include "haptic_core/collision/convex_pieces.h"

#include <algorithm>

namespace farfeel::collision {
namespace {

constexpr double kSameDirection = 1 - 1e-12;  // cosine: outward normals closer than a microradian count once
constexpr double kClosed = 1e-6;              // of the area: a closed surface's area vectors add to less

std::uint32_t padded(std::uint32_t count) {
  return (count + 3) & ~3U;
}

}  // namespace

ConvexPieces::ConvexPieces(const geometry::HapticSurface& surface)
    : ConvexPieces(surface.coarse, surface.triangle_piece, surface.piece_count) {}

ConvexPieces::ConvexPieces(const geometry::TriangleMesh& mesh, std::span<const std::uint32_t> triangle_piece,
                           std::uint32_t count) {
  const geometry::Box box = geometry::bounding_box(mesh);
  if (box.is_empty()) return;
  centre_O = box.centre();
  std::vector<std::vector<std::uint32_t>> triangles_of(count);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) triangles_of[triangle_piece[t]].push_back(t);

  geometry::Box all;
  for (const auto& triangles : triangles_of) {
    std::vector<std::uint32_t> corners;
    for (const std::uint32_t t : triangles) {
      corners.insert(corners.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
    }
    if (corners.empty()) corners.push_back(0);
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    std::vector<glm::dvec3> points;
    for (const std::uint32_t c : corners) points.push_back(mesh.positions_O[c] - centre_O);
    const ConvexHull hull = convex_hull(points);

    ConvexPiece piece{};
    piece.first_vertex = std::uint32_t(x.size());
    piece.vertex_count = padded(std::uint32_t(hull.vertices.size()));
    geometry::Box extent;
    for (std::uint32_t k = 0; k < piece.vertex_count; ++k) {
      const glm::dvec3& p = points[hull.vertices[std::min<std::size_t>(k, hull.vertices.size() - 1)]];
      x.push_back(p.x), y.push_back(p.y), z.push_back(p.z);
      extent.include(p), all.include(p);
    }
    piece.low = extent.low, piece.high = extent.high;
    piece.first_face = std::uint32_t(faces.size());
    piece.face_count = std::uint32_t(hull.faces.size());
    faces.insert(faces.end(), hull.faces.begin(), hull.faces.end());
    piece.first_edge = std::uint32_t(edges.size());
    piece.edge_count = std::uint32_t(hull.edges.size());
    edges.insert(edges.end(), hull.edges.begin(), hull.edges.end());

    piece.first_outward = std::uint32_t(outwards.size());
    glm::dvec3 area(0);
    double total = 0;
    for (const std::uint32_t t : triangles) {
      const auto& [a, b, c] = mesh.triangles[t];
      const glm::dvec3 twice =
          glm::cross(mesh.positions_O[b] - mesh.positions_O[a], mesh.positions_O[c] - mesh.positions_O[a]);
      if (!(glm::length(twice) > 0)) continue;
      area += twice, total += glm::length(twice);
      const glm::dvec3 n = glm::normalize(twice);
      const auto known = [&](const glm::dvec3& m) { return glm::dot(n, m) > kSameDirection; };
      if (std::none_of(outwards.begin() + piece.first_outward, outwards.end(), known)) outwards.push_back(n);
    }
    piece.outward_count = std::uint32_t(outwards.size()) - piece.first_outward;
    piece.faces_every_way = piece.outward_count == 0 || glm::length(area) <= kClosed * total;
    pieces.push_back(piece);
  }
  low = all.low, high = all.high;
}

double ConvexPieces::outwardness(const ConvexPiece& piece, const glm::dvec3& d_O) const noexcept {
  if (piece.faces_every_way) return 1;
  double best = -1;
  for (std::uint32_t k = 0; k < piece.outward_count; ++k) {
    best = std::max(best, glm::dot(outwards[piece.first_outward + k], d_O));
  }
  return best;
}

}  // namespace farfeel::collision
