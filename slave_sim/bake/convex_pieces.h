// Convex surface pieces: the patches of a coarse mesh that proximity queries work on.
//
// A piece is a connected patch whose triangles all lie on the boundary of the patch's own convex hull: no vertex of the
// patch stands above the plane of any of its triangles by more than a tolerance. Nor does the hull reach across an edge
// where the surface falls away: a face round a hole is several pieces. After Ehmann & Lin, Eurographics 2001.
#pragma once

#include <cstdint>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

struct ConvexPieces {
  std::vector<std::uint32_t> triangle_piece;  ///< per triangle, < count
  std::uint32_t count = 0;
};

struct PieceOptions {
  double tolerance_m = 0;  ///< >= 0
  /// Normals of a piece stay within this angle of its mean normal, so that the piece knows which way is out. A whole
  /// connected shell that is convex is one piece all the same.
  double cone_rad = 0.9;
};

/// Greedy: the largest free triangle seeds a piece, which takes neighbours while the union stays convex.
/// Precondition: closed and oriented.
[[nodiscard]] ConvexPieces convex_pieces(const geometry::TriangleMesh&, const PieceOptions&);

/// How far any vertex of a piece stands above the plane of any triangle of the same piece, at most [m].
[[nodiscard]] double worst_concavity_m(const geometry::TriangleMesh&, const ConvexPieces&);

/// The neighbour across each edge i -> i + 1 of every triangle of a closed mesh.
[[nodiscard]] std::vector<geometry::Triangle> triangle_neighbours(const geometry::TriangleMesh&);

}  // namespace farfeel::slave_sim
