// The convex surface pieces of one object, ready for proximity queries.
//
// A piece is a set of triangles of the surface. For distances it stands for the convex hull of their vertices, which is
// flat for a third of the pieces of real models; for directions it keeps which way its own triangles face, because part
// of its hull is not surface at all but the virtual cap that closes it (Ehmann & Lin 2001).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "haptic_core/collision/convex_pair.h"
#include "haptic_core/collision/outward_map.h"
#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::collision {

/// Where a piece stands in ConvexPieces' arrays. Its vertices, outward directions and faces follow each other in
/// `numbers`, each written as all x, all y, all z: a query that needs one soon needs the next.
struct ConvexPiece {
  std::uint32_t first_number;
  std::uint32_t vertex_count, outward_count, face_count;  ///< each filled up to a multiple of four
  std::uint32_t outward_face_count;                       ///< these come first, see OutwardMap
  std::uint32_t first_edge, edge_count, outward_edge_count;
  std::uint32_t first_edge_at;
};

class ConvexPieces {
 public:
  /// None yet. centre: a point of O near all of them, for add_piece().
  explicit ConvexPieces(const glm::dvec3& centre = glm::dvec3(0)) : centre_O(centre) {}
  /// One piece for each index below surface.piece_count, in that order. Precondition: faults(surface) is empty.
  explicit ConvexPieces(const geometry::HapticSurface& surface);
  /// The same from a mesh and the piece of each triangle; pieces that no triangle names get the mesh's first vertex.
  ConvexPieces(const geometry::TriangleMesh& mesh, std::span<const std::uint32_t> triangle_piece, std::uint32_t count);

  /// The hull of points_O (at least one), which faces outwards_O (unit; none: every direction). Returns its index.
  std::uint32_t add_piece(std::span<const glm::dvec3> points_O, std::span<const glm::dvec3> outwards_O);

  [[nodiscard]] std::uint32_t size() const { return std::uint32_t(pieces.size()); }

  std::vector<ConvexPiece> pieces;
  std::vector<geometry::Box> boxes;                      ///< one a piece, less centre_O [m]
  std::vector<double> numbers;                           ///< coordinates and offsets less centre_O [m]
  std::vector<HullEdge> edges;                           ///< ends and faces count within the piece
  std::vector<std::array<std::uint32_t, 2>> edge_faces;  ///< HullEdge::faces again, close together
  std::vector<std::uint32_t> edges_at;                   ///< HullShape::edges_at of one piece after another
  glm::dvec3 centre_O;  ///< subtracted first, so that objects far from their own origin lose nothing [m]
  geometry::Box box;    ///< of all, less centre_O [m]

  /// In the object's frame, less centre_O.
  [[nodiscard]] HullVertices vertices(std::uint32_t piece) const noexcept {
    const ConvexPiece& p = pieces[piece];
    return triples(p.first_number, p.vertex_count);
  }
  /// Distinct unit normals of the piece's triangles; none when it faces every way: closed, or flat and two-sided.
  /// A direction is admissible for a piece when its outwardness (hull_support.h) is >= 0.
  [[nodiscard]] HullVertices outwards(std::uint32_t piece) const noexcept {
    const ConvexPiece& p = pieces[piece];
    return triples(p.first_number + 3 * p.vertex_count, p.outward_count);
  }
  [[nodiscard]] HullShape shape(std::uint32_t piece) const noexcept {
    const ConvexPiece& p = pieces[piece];
    const auto [x, y, z, count] = triples(p.first_number + 3 * (p.vertex_count + p.outward_count), p.face_count);
    return {vertices(piece),
            {x, y, z, z + count, count},
            {edges.data() + p.first_edge, p.edge_count},
            {edge_faces.data() + p.first_edge, p.edge_count},
            edges_at.data() + p.first_edge_at,
            outwards(piece),
            p.outward_face_count,
            p.outward_edge_count};
  }

 private:
  void add_edges_at(const std::vector<HullEdge>& of_piece, std::uint32_t vertices);
  std::uint32_t add_triples(const std::vector<glm::dvec3>& values, const glm::dvec3& filler);
  [[nodiscard]] HullVertices triples(std::uint32_t first, std::uint32_t count) const noexcept {
    const double* at = numbers.data() + first;
    return {at, at + count, at + 2 * count, count};
  }
};

}  // namespace farfeel::collision
