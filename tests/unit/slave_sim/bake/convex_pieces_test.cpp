#include "slave_sim/bake/convex_pieces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "slave_sim/bake/edge_collapse.h"
#include "slave_sim/models/lattice_solid.h"
#include "slave_sim/models/models.h"
#include "tests/support/solids.h"

namespace farfeel::slave_sim {
namespace {

void expect_partition_into_connected_pieces(const geometry::TriangleMesh& mesh, const ConvexPieces& pieces) {
  ASSERT_EQ(pieces.triangle_piece.size(), mesh.triangles.size());
  const auto neighbours = triangle_neighbours(mesh);
  std::vector<bool> is_seen(mesh.triangles.size());
  std::set<std::uint32_t> met;
  for (std::uint32_t seed = 0; seed < mesh.triangles.size(); ++seed) {
    if (is_seen[seed]) continue;
    EXPECT_LT(pieces.triangle_piece[seed], pieces.count);
    EXPECT_TRUE(met.insert(pieces.triangle_piece[seed]).second) << "piece in two parts";
    std::vector<std::uint32_t> patch{seed};
    is_seen[seed] = true;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      for (const std::uint32_t n : neighbours[patch[i]]) {
        if (is_seen[n] || pieces.triangle_piece[n] != pieces.triangle_piece[seed]) continue;
        is_seen[n] = true;
        patch.push_back(n);
      }
    }
  }
  EXPECT_EQ(met.size(), pieces.count);
}

TEST(ConvexPiecesTest, ConvexShellsAreOnePieceEach) {
  for (const geometry::TriangleMesh& mesh : {block_base(), gear_base()}) {
    const ConvexPieces pieces = convex_pieces(mesh, {.tolerance_m = 1e-8});
    EXPECT_EQ(pieces.count, 1U);
    expect_partition_into_connected_pieces(mesh, pieces);
    EXPECT_LE(worst_concavity_m(mesh, pieces), 1e-8);
  }
}

TEST(ConvexPiecesTest, AnLShapeIsCutAtItsReentrantEdge) {
  const LatticeSolid solid{.cuts_m = {{{0, 1, 2}, {0, 1}, {0, 1, 2}}},
                           .steps = {{{1, 1}, {1}, {1, 1}}},
                           .is_solid = [](int i, int, int k) { return i == 0 || k == 0; }};
  const geometry::TriangleMesh mesh = skin(solid, [](const LatticePoint& at) { return at.p; });
  const ConvexPieces pieces = convex_pieces(mesh, {});
  expect_partition_into_connected_pieces(mesh, pieces);
  EXPECT_EQ(worst_concavity_m(mesh, pieces), 0);
  EXPECT_GT(pieces.count, 1U);
}

// A hull that covers a hole would be felt by whatever goes through it.
TEST(ConvexPiecesTest, NoHullReachesIntoAHole) {
  const LatticeSolid solid{.cuts_m = {{{0, 1, 2, 3}, {0, 1, 2, 3}, {0, 1}}},
                           .steps = {{{2, 2, 2}, {2, 2, 2}, {2}}},
                           .is_solid = [](int i, int j, int) { return i != 1 || j != 1; }};
  const geometry::TriangleMesh mesh = skin(solid, [](const LatticePoint& at) { return at.p; });
  const ConvexPieces pieces = convex_pieces(mesh, {.tolerance_m = 1e-9});
  expect_partition_into_connected_pieces(mesh, pieces);
  std::vector<geometry::Box> boxes(pieces.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) boxes[pieces.triangle_piece[t]].include(mesh.positions_O[v]);
  }
  for (const geometry::Box& box : boxes) {  // the pieces of this mesh are as large as their boxes, or smaller
    const bool reaches_in = box.low.x < 2 && box.high.x > 1 && box.low.y < 2 && box.high.y > 1;
    EXPECT_FALSE(reaches_in) << box.low.x << ' ' << box.high.x << ' ' << box.low.y << ' ' << box.high.y;
  }
}

TEST(ConvexPiecesTest, EveryPieceIsConvexWithinItsTolerance) {
  const geometry::TriangleMesh mesh = edge_collapsed(block_mesh(), 600);
  for (const double tolerance_m : {0.0, 1e-5, 1e-4}) {
    const ConvexPieces pieces = convex_pieces(mesh, {.tolerance_m = tolerance_m});
    expect_partition_into_connected_pieces(mesh, pieces);
    EXPECT_LE(worst_concavity_m(mesh, pieces), tolerance_m + 1e-15);
    EXPECT_LT(pieces.count, mesh.triangles.size());
  }
}

/// Six lobes whose patches fail the last look again and again. A piece that may not grow anew keeps what passed.
TEST(ConvexPiecesTest, APieceGrowsAnewAsLongAsItMayAndPassesTheLastLookEitherWay) {
  const geometry::TriangleMesh mesh =
      support::turned_mesh({.sides = 60, .rows = 4, .is_ring = false, .profile = [](std::uint32_t row, double theta) {
                              const double r_m = 0.06 - 0.006 * (1 - std::cos(6 * theta));
                              return support::ProfilePoint{row % 3 == 0 ? 0.5 * r_m : r_m, row < 2 ? 0 : 0.03};
                            }});
  std::vector<std::vector<std::uint32_t>> cuts;
  for (const double most_regrown : {0.0, 1.0}) {
    const ConvexPieces pieces = convex_pieces(mesh, {.tolerance_m = 5e-5, .most_regrown = most_regrown});
    expect_partition_into_connected_pieces(mesh, pieces);
    EXPECT_EQ(hull_breaches(mesh, pieces, 1e-4).outside, 0U) << most_regrown;
    cuts.push_back(pieces.triangle_piece);
  }
  EXPECT_NE(cuts[0], cuts[1]);
}

}  // namespace
}  // namespace farfeel::slave_sim
