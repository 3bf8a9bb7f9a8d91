// What the collision benchmark asks of every library, ours included.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "haptic_core/collision/hull_tree.h"
#include "haptic_core/spatial/spatial.h"
#include "tests/support/exact_proximity.h"

namespace farfeel::bench {

struct PeerPair {
  std::uint32_t piece_s, piece_t;
  double distance_m;
  glm::dvec3 nhat_ST_S;
};

/// One library holding one pair of objects.
class CollisionPeer {
 public:
  virtual ~CollisionPeer() = default;
  /// Finds every pair of pieces nearer than the tolerance, in the library's own form. Only this call is timed.
  virtual void query(double tolerance_m, const spatial::Pose& X_ST) = 0;
  /// What the last query found. Valid until the next.
  virtual const std::vector<PeerPair>& pairs() = 0;
  /// Forgets what it knows from earlier calls.
  virtual void forget() = 0;
};

/// One convex pair, for the suites of hard cases.
struct PeerAnswer {
  double distance_m;
  glm::dvec3 direction;
};

struct CollisionLibrary {
  std::string name;
  std::unique_ptr<CollisionPeer> (*open)(const collision::HullTree& S, const collision::HullTree& T,
                                         double tolerance_m);
  PeerAnswer (*measure)(const support::PointHull& A, const support::PointHull& B);
};

/// Ours first; then what this build found of Bullet and FCL.
[[nodiscard]] std::vector<CollisionLibrary> collision_libraries();
/// "name: why", for those it did not find.
[[nodiscard]] std::vector<std::string> missing_collision_libraries();

[[nodiscard]] CollisionLibrary farfeel_library();
[[nodiscard]] CollisionLibrary bullet_library();
[[nodiscard]] CollisionLibrary fcl_library();

}  // namespace farfeel::bench
