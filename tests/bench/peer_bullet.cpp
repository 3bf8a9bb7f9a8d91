// Bullet in double precision as its manual recommends: convex hull shapes without margin, a btDbvtBroadphase whose
// pairs are filtered to S against T, one GJK/EPA detector a pair with the separating axis of the last frame, and sizes
// between 0.05 and 10 units (here: centimetres).
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <btBulletCollisionCommon.h>

#include <limits>
#include <unordered_map>

#include "tests/bench/collision_peer.h"

namespace farfeel::bench {
namespace {

constexpr double kUnits = 100;  // a metre in centimetres

btVector3 to_bullet(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}
glm::dvec3 from_bullet(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}

std::unique_ptr<btConvexHullShape> shape_of(std::span<const glm::dvec3> points, double units) {
  auto shape = std::make_unique<btConvexHullShape>();
  for (const glm::dvec3& p : points) shape->addPoint(units * to_bullet(p), false);
  shape->setMargin(0);
  shape->recalcLocalAabb();
  return shape;
}

std::vector<glm::dvec3> points_of(const collision::ConvexPieces& pieces, std::uint32_t i) {
  std::vector<glm::dvec3> points;
  const collision::HullVertices vertices = pieces.vertices(std::uint32_t(i));
  for (std::uint32_t k = 0; k < vertices.count; ++k) {
    const glm::dvec3 p = vertices.at(k) + pieces.centre_O;
    if (points.empty() || points.back() != p) points.push_back(p);
  }
  return points;
}

class Bullet final : public CollisionPeer {
 public:
  Bullet(const collision::HullTree& S, const collision::HullTree& T, double tolerance_m)
      : tolerance_(tolerance_m * kUnits) {
    for (std::uint32_t i = 0; i < S.pieces().size(); ++i)
      shapes_s_.push_back(shape_of(points_of(S.pieces(), i), kUnits));
    for (std::uint32_t i = 0; i < T.pieces().size(); ++i)
      shapes_t_.push_back(shape_of(points_of(T.pieces(), i), kUnits));
    const auto add = [&](std::vector<std::unique_ptr<btConvexHullShape>>& shapes, int group, int mask, double margin,
                         std::vector<btBroadphaseProxy*>& proxies) {
      for (std::size_t i = 0; i < shapes.size(); ++i) {
        btVector3 low, high;
        shapes[i]->getAabb(btTransform::getIdentity(), low, high);
        const btVector3 around(margin, margin, margin);
        proxies.push_back(broadphase_.createProxy(low - around, high + around, CONVEX_HULL_SHAPE_PROXYTYPE,
                                                  reinterpret_cast<void*>(i), group, mask, nullptr));
      }
    };
    add(shapes_s_, 1, 2, 0, proxies_s_);
    add(shapes_t_, 2, 1, tolerance_, proxies_t_);
    broadphase_.optimize();
  }
  ~Bullet() override {
    for (auto* proxies : {&proxies_s_, &proxies_t_}) {
      for (btBroadphaseProxy* p : *proxies) broadphase_.destroyProxy(p, nullptr);
    }
  }

  void query(double tolerance_m, const spatial::Pose& X_ST) override {
    pairs_.clear();
    const btTransform X(btQuaternion(X_ST.R.x, X_ST.R.y, X_ST.R.z, X_ST.R.w), kUnits * to_bullet(X_ST.p));
    for (std::size_t i = 0; i < proxies_t_.size(); ++i) {
      btVector3 low, high;
      shapes_t_[i]->getAabb(X, low, high);
      const btVector3 around(tolerance_, tolerance_, tolerance_);
      broadphase_.setAabb(proxies_t_[i], low - around, high + around, nullptr);
    }
    broadphase_.calculateOverlappingPairs(nullptr);
    btBroadphasePairArray& near = broadphase_.getOverlappingPairCache()->getOverlappingPairArray();
    for (int k = 0; k < near.size(); ++k) {
      const bool first_is_s = near[k].m_pProxy0->m_collisionFilterGroup == 1;
      const auto* proxy_s = first_is_s ? near[k].m_pProxy0 : near[k].m_pProxy1;
      const auto* proxy_t = first_is_s ? near[k].m_pProxy1 : near[k].m_pProxy0;
      const auto s = std::uint32_t(reinterpret_cast<std::uintptr_t>(proxy_s->m_clientObject));
      const auto t = std::uint32_t(reinterpret_cast<std::uintptr_t>(proxy_t->m_clientObject));
      btGjkPairDetector detector(shapes_s_[s].get(), shapes_t_[t].get(), &simplex_, &depth_);
      btVector3& axis = axes_.try_emplace(std::uint64_t(s) << 32 | t, btVector3(0, 1, 0)).first->second;
      detector.setCachedSeparatingAxis(axis);
      btGjkPairDetector::ClosestPointInput input;
      input.m_transformA = btTransform::getIdentity();
      input.m_transformB = X;
      input.m_maximumDistanceSquared = tolerance_m * tolerance_m * kUnits * kUnits;
      btPointCollector result;
      detector.getClosestPoints(input, result, nullptr);
      axis = detector.getCachedSeparatingAxis();
      if (!result.m_hasResult || !(result.m_distance < tolerance_m * kUnits)) continue;
      pairs_.push_back({s, t, result.m_distance / kUnits, -from_bullet(result.m_normalOnBInWorld)});
    }
  }
  const std::vector<PeerPair>& pairs() override { return pairs_; }
  void forget() override { axes_.clear(); }

 private:
  std::vector<PeerPair> pairs_;
  double tolerance_;
  std::vector<std::unique_ptr<btConvexHullShape>> shapes_s_, shapes_t_;
  btDbvtBroadphase broadphase_;
  std::vector<btBroadphaseProxy*> proxies_s_, proxies_t_;
  std::unordered_map<std::uint64_t, btVector3> axes_;
  btVoronoiSimplexSolver simplex_;
  btGjkEpaPenetrationDepthSolver depth_;
};

PeerAnswer measure(const support::PointHull& A, const support::PointHull& B) {
  const auto a = shape_of(A.points, 1), b = shape_of(B.points, 1);
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver depth;
  btGjkPairDetector detector(a.get(), b.get(), &simplex, &depth);
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA = input.m_transformB = btTransform::getIdentity();
  btPointCollector result;
  detector.getClosestPoints(input, result, nullptr);
  if (!result.m_hasResult) return {std::numeric_limits<double>::quiet_NaN(), glm::dvec3(0)};
  return {result.m_distance, -from_bullet(result.m_normalOnBInWorld)};
}

}  // namespace

CollisionLibrary bullet_library() {
  return {
      "bullet_f64",
      [](const collision::HullTree& S, const collision::HullTree& T,
         double tolerance_m) -> std::unique_ptr<CollisionPeer> { return std::make_unique<Bullet>(S, T, tolerance_m); },
      measure};
}

}  // namespace farfeel::bench
