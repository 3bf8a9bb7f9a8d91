#include "haptic_core/contact/depth/plane_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "haptic_core/penetration/reference/reference.h"
#include "tests/support/solids.h"

namespace farfeel::contact {
namespace {

using penetration::FeltSurface;
using penetration::Penetration;
using penetration::Query;
using spatial::Pose;
using spatial::Vector6;

constexpr double kWidth_m = penetration::kDefaultSoftWidth_m;

struct Pair {
  geometry::HapticSurface s_surface, t_surface;
  FeltSurface s{s_surface}, t{t_surface};
  std::vector<std::uint32_t> s_all = std::vector<std::uint32_t>(s_surface.coarse.triangles.size()),
                             t_all = std::vector<std::uint32_t>(t_surface.coarse.triangles.size());

  Pair(const geometry::TriangleMesh& a, const geometry::TriangleMesh& b)
      : s_surface(support::untextured(a)), t_surface(support::untextured(b)) {
    std::iota(s_all.begin(), s_all.end(), 0u);
    std::iota(t_all.begin(), t_all.end(), 0u);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;
  [[nodiscard]] Query query(const Pose& X_CT, double deepest_m = 1) const {
    return {.s = {&s, {{1, 0, 0, 0}, {0, 0, -0.005}}, s_all},  // its upper face in z = 0
            .t = {&t, X_CT, t_all},
            .window = {{-0.02, -0.02}, {0.02, 0.02}},
            .samples = 100,
            .soft_width_m = kWidth_m,
            .deepest_m = deepest_m};
  }
};

Pair boxes() {
  return {support::box_mesh({0.030, 0.030, 0.010}), support::box_mesh({0.010, 0.008, 0.006})};
}

Pose leaning(std::mt19937& random, double most_rad, double over_m) {
  std::uniform_real_distribution<double> within(-1, 1);
  return {spatial::rotation_from_vector(most_rad * glm::dvec3{within(random), within(random), within(random)}),
          {over_m * within(random), over_m * within(random), 0.003 - 1e-4 + 5e-5 * within(random)}};
}

TEST(PlaneDepth, FlatOnFlatIsTheAreaInClosedForm) {
  const Pair pair = boxes();
  PlaneDepth plane({});
  const Penetration answer = plane.evaluate(pair.query({{1, 0, 0, 0}, {0, 0, 0.003 - 0.2e-3}}));
  EXPECT_NEAR(answer.depth_m, 0.2e-3 + kWidth_m * std::log(80e-6 / penetration::kReferenceArea_m2), 1e-10);
  EXPECT_NEAR(answer.gradient[5], -1, 1e-9);
  EXPECT_LT(answer.gradient.head<5>().norm(), 1e-9);
}

TEST(PlaneDepth, TheGradientIsTheDepthsDerivativeEdgesAndCornersIncluded) {
  const Pair pair = boxes();
  PlaneDepth plane({});
  std::mt19937 random(3);
  for (int trial = 0; trial < 60; ++trial) {
    const Pose X_CT = leaning(random, trial % 2 == 0 ? 0.02 : 0.4, trial % 3 == 0 ? 0.016 : 0.004);
    const Penetration answer = plane.evaluate(pair.query(X_CT));
    if (!answer.is_known()) continue;
    for (int k = 0; k < 6; ++k) {
      const double step = k < 3 ? 1e-7 : 1e-9;
      double depth[2];
      for (const int side : {0, 1}) {
        const Vector6 q = (side == 0 ? step : -step) * Vector6::Unit(k);
        const Pose moved{glm::normalize(spatial::rotation_from_vector({q[0], q[1], q[2]}) * X_CT.R),
                         X_CT.p + glm::dvec3{q[3], q[4], q[5]}};
        depth[side] = plane.evaluate(pair.query(moved)).depth_m;
      }
      EXPECT_NEAR(answer.gradient[k], (depth[0] - depth[1]) / (2 * step), 2e-5 * (k < 3 ? 0.01 : 1) + 1e-6)
          << trial << ' ' << k;
    }
  }
}

// The reference fades edges over 0.2 mm, as if they were rounded: that lowers an edge's depth, and a corner's twice.
TEST(PlaneDepth, TheReferenceGivesTheSameUpToItsRoundedEdges) {
  const Pair pair = boxes();
  PlaneDepth plane({});
  const auto reference = penetration::make_reference({});
  std::mt19937 random(5);
  for (int trial = 0; trial < 25; ++trial) {
    const double lean = trial % 2 == 0 ? 2e-4 : 0.2;
    const Query query = pair.query(leaning(random, lean, 0.004));
    Penetration slow;
    reference->evaluate({&query, 1}, {&slow, 1});
    const Penetration fast = plane.evaluate(query);
    ASSERT_TRUE(fast.is_known());
    ASSERT_TRUE(slow.is_known());
    EXPECT_GT(fast.depth_m, slow.depth_m - 1e-6);
    EXPECT_LT(fast.depth_m, slow.depth_m + (lean < 0.01 ? 0.6 : 12) * kWidth_m);
    if (lean < 0.01) {
      EXPECT_LT((fast.gradient - slow.gradient).norm(), 0.02);
    }
  }
}

TEST(PlaneDepth, TheHessianIsTheGradientsDerivative) {
  const Pair pair = boxes();
  PlaneDepth plane({});
  Query query = pair.query({spatial::rotation_from_vector({1e-3, 2e-3, 0}), {1e-3, 0, 0.003 - 0.1e-3}});
  query.wants_hessian = true;
  const spatial::Matrix6 H = plane.evaluate(query).hessian;
  query.wants_hessian = false;
  const double step = 1e-6;
  const Vector6 before = plane.evaluate(query).gradient;
  query.t.X_CO.R = spatial::rotation_from_vector({step, 0, 0}) * query.t.X_CO.R;
  const Vector6 after = plane.evaluate(query).gradient;
  EXPECT_LT(((after - before) / step - H.col(0)).norm(), 0.02 * H.col(0).norm());
}

TEST(PlaneDepth, NothingSharedIsUnknown) {
  const Pair pair = boxes();
  PlaneDepth plane({});
  EXPECT_FALSE(plane.evaluate(pair.query({{1, 0, 0, 0}, {0.05, 0, 0}})).is_known());
}

}  // namespace
}  // namespace farfeel::contact
