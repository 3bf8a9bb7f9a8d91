// FCL as its examples show: one dynamic AABB tree for each object, T's updated every frame, and a distance callback
// that keeps the search radius at the tolerance; signed distance by its default (libccd) solver.
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/bench/collision_peer.h"

namespace farfeel::bench {
namespace {

fcl::Vector3d to_fcl(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

// FCL wants polygons: the vertices on each face's plane, counter-clockwise.
std::shared_ptr<fcl::Convexd> shape_of(std::span<const glm::dvec3> points) {
  const collision::ConvexHull hull = collision::convex_hull(points);
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  double size = 0;
  for (const auto i : hull.vertices)
    vertices->push_back(to_fcl(points[i])), size = std::max(size, glm::length(points[i]));
  auto faces = std::make_shared<std::vector<int>>();
  int count = 0;
  for (const auto& face : hull.faces) {
    std::vector<int> corners;
    glm::dvec3 middle(0);
    for (std::size_t k = 0; k < hull.vertices.size(); ++k) {
      const glm::dvec3& p = points[hull.vertices[k]];
      if (std::abs(glm::dot(face.normal, p) - face.offset_m) < 1e-9 * size) corners.push_back(int(k)), middle += p;
    }
    if (corners.size() < 3) continue;
    middle /= double(corners.size());
    const glm::dvec3 u = points[hull.vertices[std::size_t(corners[0])]] - middle, v = glm::cross(face.normal, u);
    const auto angle = [&](int k) {
      const glm::dvec3 p = points[hull.vertices[std::size_t(k)]] - middle;
      return std::atan2(glm::dot(p, v), glm::dot(p, u));
    };
    std::sort(corners.begin(), corners.end(), [&](int a, int b) { return angle(a) < angle(b); });
    faces->push_back(int(corners.size()));
    faces->insert(faces->end(), corners.begin(), corners.end());
    ++count;
  }
  return std::make_shared<fcl::Convexd>(vertices, count, faces);
}

fcl::DistanceRequestd request() {
  fcl::DistanceRequestd r(true, true);
  r.gjk_solver_type = fcl::GST_LIBCCD;
  return r;
}

class Fcl final : public CollisionPeer {
 public:
  Fcl(const collision::HullTree& S, const collision::HullTree& T, double) {
    fill(S.pieces(), objects_s_, manager_s_);
    fill(T.pieces(), objects_t_, manager_t_);
  }
  void query(double tolerance_m, const spatial::Pose& X_ST) override {
    pairs_.clear();
    fcl::Transform3d X = fcl::Transform3d::Identity();
    X.linear() = Eigen::Quaterniond(X_ST.R.w, X_ST.R.x, X_ST.R.y, X_ST.R.z).toRotationMatrix();
    X.translation() = to_fcl(X_ST.p);
    for (auto& object : objects_t_) object->setTransform(X), object->computeAABB();
    manager_t_.update();
    Search search{this, tolerance_m, &pairs_};
    manager_s_.distance(&manager_t_, &search,
                        [](fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, void* data, double& least) {
                          auto& s = *static_cast<Search*>(data);
                          s.peer->measure(a, b, s.tolerance_m, *s.pairs);
                          least = s.tolerance_m;
                          return false;
                        });
  }
  const std::vector<PeerPair>& pairs() override { return pairs_; }
  void forget() override {}

 private:
  std::vector<PeerPair> pairs_;
  struct Search {
    Fcl* peer;
    double tolerance_m;
    std::vector<PeerPair>* pairs;
  };
  void fill(const collision::ConvexPieces& pieces, std::vector<std::unique_ptr<fcl::CollisionObjectd>>& objects,
            fcl::DynamicAABBTreeCollisionManagerd& manager) {
    std::vector<fcl::CollisionObjectd*> all;
    for (std::uintptr_t i = 0; i < pieces.size(); ++i) {
      std::vector<glm::dvec3> points;
      const collision::HullVertices vertices = pieces.vertices(std::uint32_t(i));
      for (std::uint32_t k = 0; k < vertices.count; ++k) {
        points.push_back(vertices.at(k) + pieces.centre_O);
      }
      objects.push_back(std::make_unique<fcl::CollisionObjectd>(shape_of(points)));
      objects.back()->setUserData(reinterpret_cast<void*>(i));
      all.push_back(objects.back().get());
    }
    manager.registerObjects(all);
    manager.setup();
  }
  void measure(fcl::CollisionObjectd* a, fcl::CollisionObjectd* b, double tolerance_m, std::vector<PeerPair>& pairs) {
    const auto is_s = [&](const fcl::CollisionObjectd* o) {
      const auto i = reinterpret_cast<std::uintptr_t>(o->getUserData());
      return i < objects_s_.size() && objects_s_[i].get() == o;
    };
    if (!is_s(a)) std::swap(a, b);
    fcl::DistanceResultd result;
    const double distance = fcl::distance(a, b, request(), result);
    if (!(distance < tolerance_m)) return;
    const fcl::Vector3d n = (result.nearest_points[1] - result.nearest_points[0]) / distance;
    pairs.push_back({std::uint32_t(reinterpret_cast<std::uintptr_t>(a->getUserData())),
                     std::uint32_t(reinterpret_cast<std::uintptr_t>(b->getUserData())),
                     distance,
                     {n.x(), n.y(), n.z()}});
  }

  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_s_, objects_t_;
  fcl::DynamicAABBTreeCollisionManagerd manager_s_, manager_t_;
};

PeerAnswer measure(const support::PointHull& A, const support::PointHull& B) {
  const auto a = shape_of(A.points), b = shape_of(B.points);
  fcl::DistanceResultd result;
  const fcl::Transform3d at = fcl::Transform3d::Identity();
  const double distance = fcl::distance(a.get(), at, b.get(), at, request(), result);
  const fcl::Vector3d n = (result.nearest_points[1] - result.nearest_points[0]) / distance;
  return {distance, {n.x(), n.y(), n.z()}};
}

}  // namespace

CollisionLibrary fcl_library() {
  return {"fcl",
          [](const collision::HullTree& S, const collision::HullTree& T,
             double tolerance_m) -> std::unique_ptr<CollisionPeer> { return std::make_unique<Fcl>(S, T, tolerance_m); },
          measure};
}

}  // namespace farfeel::bench
