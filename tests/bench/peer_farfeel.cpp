#include "haptic_core/collision/proximity_query.h"
#include "tests/bench/collision_peer.h"

namespace farfeel::bench {
namespace {

class Farfeel final : public CollisionPeer {
 public:
  Farfeel(const collision::HullTree& S, const collision::HullTree& T) : query_(S, T) {}
  void query(double tolerance_m, const spatial::Pose& X_ST) override { found_ = query_.nearer_than(tolerance_m, X_ST); }
  const std::vector<PeerPair>& pairs() override {
    pairs_.clear();
    for (const collision::ProximityPair& p : found_) {
      pairs_.push_back({p.piece_s, p.piece_t, p.distance_m, p.nhat_ST_S});
    }
    return pairs_;
  }
  void forget() override { query_.restart(); }

 private:
  collision::ProximityQuery query_;
  std::span<const collision::ProximityPair> found_;
  std::vector<PeerPair> pairs_;
};

// The triangles face where `outwards` say, so a case's piece is one triangle fan per outward direction over its points.
collision::HullTree tree_of(const support::PointHull& hull) {
  collision::ConvexPieces pieces;
  pieces.add_piece(hull.points, hull.outwards);
  return collision::HullTree(std::move(pieces));
}

PeerAnswer measure(const support::PointHull& A, const support::PointHull& B) {
  const collision::HullTree S = tree_of(A), T = tree_of(B);
  collision::ProximityQuery query(S, T);
  const auto pairs = query.nearer_than(1e300, {});
  if (pairs.empty()) return {std::numeric_limits<double>::quiet_NaN(), glm::dvec3(0)};
  return {pairs[0].distance_m, pairs[0].nhat_ST_S};
}

}  // namespace

CollisionLibrary farfeel_library() {
  return {"ours",
          [](const collision::HullTree& S, const collision::HullTree& T, double) -> std::unique_ptr<CollisionPeer> {
            return std::make_unique<Farfeel>(S, T);
          },
          measure};
}

}  // namespace farfeel::bench
