// Convex surface pieces: the patches of a coarse mesh that proximity queries work on.
//
// A piece is a connected patch whose triangles all lie on the boundary of the patch's own convex hull: no vertex of the
// patch stands above the plane of any of its triangles by more than a tolerance. After Ehmann & Lin, Eurographics 2001.
// And the hull keeps to its own side of the material (own_side.h): a face round a hole is several pieces, and so is the
// outside of a bowl, because a tool in its hollow must not touch it.
#pragma once

#include <cstdint>
#include <vector>

#include "codecs/asset/asset.h"
#include "haptic_core/geometry/triangle_mesh.h"
#include "slave_sim/bake/own_side.h"

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
  /// Of own_side.h: how far a hull may leave the solid, or pass its middle; some tens of micrometres, well below what
  /// is pressed.
  double own_side_m = 5e-5;
  /// A piece that fails the last look grows anew over at most so many times the mesh's triangles, all times together.
  double most_regrown = 1;
};

/// Greedy: the largest free triangle seeds a piece, which takes neighbours while the union stays convex and on its own
/// side. Then every piece is looked at once more, finely, and cut again, by the stricter rule, where it fails.
/// Precondition: closed and oriented.
[[nodiscard]] ConvexPieces convex_pieces(const geometry::TriangleMesh&, const PieceOptions&);

/// How far any vertex of a piece stands above the plane of any triangle of the same piece, at most [m].
[[nodiscard]] double worst_concavity_m(const geometry::TriangleMesh&, const ConvexPieces&);

/// What the pieces' hulls do to the material, by the rule of own_side.h at random points all through them: knows
/// nothing of how they were cut. tolerance_m: more than that counts.
[[nodiscard]] codecs::HullBreaches hull_breaches(const geometry::TriangleMesh&, const ConvexPieces&,
                                                 double tolerance_m);

/// The neighbour across each edge i -> i + 1 of every triangle of a closed mesh.
[[nodiscard]] std::vector<geometry::Triangle> triangle_neighbours(const geometry::TriangleMesh&);

}  // namespace farfeel::slave_sim
