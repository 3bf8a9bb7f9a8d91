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

/// Ranges into ConvexPieces' arrays. Coordinates are in the object's frame, less ConvexPieces::centre_O.
struct ConvexPiece {
  std::uint32_t first_vertex, vertex_count;  ///< into x, y, z; padded to a multiple of four with copies of the last
  std::uint32_t first_face, face_count, outward_face_count;  ///< padded too; the outward ones first, see OutwardMap
  std::uint32_t first_edge, edge_count, outward_edge_count;
  std::uint32_t first_outward, outward_count;
  bool faces_every_way;  ///< closed surface, or flat and two-sided: every direction is outward
  geometry::Box box;     ///< [m]
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
  std::vector<double> x, y, z;                                ///< hull vertices [m], less centre_O
  std::vector<double> face_x, face_y, face_z, face_offset_m;  ///< HullFace's; measured from centre_O
  std::vector<HullEdge> edges;  ///< ends count from the piece's first vertex, faces from its first face
  std::vector<std::array<std::uint32_t, 2>> edge_faces;  ///< HullEdge::faces again
  std::vector<glm::dvec3> outwards;                      ///< distinct unit normals of the pieces' triangles
  glm::dvec3 centre_O;  ///< subtracted first, so that objects far from their own origin lose nothing [m]
  geometry::Box box;    ///< of all, less centre_O [m]

  [[nodiscard]] HullShape shape(const ConvexPiece& piece) const noexcept {
    const std::uint32_t v = piece.first_vertex, f = piece.first_face;
    return {{&x[v], &y[v], &z[v], piece.vertex_count},
            {&face_x[f], &face_y[f], &face_z[f], &face_offset_m[f], piece.face_count},
            {edges.data() + piece.first_edge, piece.edge_count},
            {edge_faces.data() + piece.first_edge, piece.edge_count},
            {outwards.data() + piece.first_outward, piece.outward_count},
            piece.outward_face_count,
            piece.outward_edge_count};
  }
  [[nodiscard]] glm::dvec3 vertex(std::uint32_t i) const { return {x[i], y[i], z[i]}; }

  /// Cosine of the least angle between d and the piece's outward normals: positive when d leads out of some triangle;
  /// 1 for pieces that face every way. A direction is admissible for a piece when this is >= 0. |d| = 1. Realtime-safe.
  [[nodiscard]] double outwardness(const ConvexPiece& piece, const glm::dvec3& d_O) const noexcept {
    if (piece.faces_every_way) return 1;
    double best = -1;
    for (std::uint32_t k = 0; k < piece.outward_count; ++k) {
      best = std::max(best, glm::dot(outwards[piece.first_outward + k], d_O));
    }
    return best;
  }
};

}  // namespace farfeel::collision
