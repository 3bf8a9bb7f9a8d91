#include "haptic_core/constraint/recess.h"

#include <gtest/gtest.h>

#include "tests/support/row_loop.h"

namespace farfeel::constraint {
namespace {

using spatial::Pose;
using test_support::RowLoop;

TEST(Recess, IsWhatARowIsDeepWhereTheProxyWasLeft) {
  Row row;
  row.gradient << 0, 0, 0, 0, 0, -1;
  row.depth_m = 1e-3;  // at Q; the proxy is 0.4 mm higher
  EXPECT_NEAR(unmade_depth_m(row, {}, {{1, 0, 0, 0}, {0, 0, 0.4e-3}}, 5e-6), 0.6e-3, 1e-15);
  EXPECT_EQ(unmade_depth_m(row, {}, {{1, 0, 0, 0}, {0, 0, 0.998e-3}}, 5e-6), 0);
}

TEST(Recess, IsInTheForceAloneAndTheProxyIsOnTheNewSurfaceAtOnce) {
  RowLoop loop({}, {2000, 1, 5, 0.005}, one_pad(2000), 1e-3, {});
  double surface_m = 0, recess_m = 0;
  const test_support::Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
    rows.push_back(test_support::point_on_plane(X_WQ, {}, {0, 0, 1}, surface_m));
    rows.back().recess_m = recess_m;
  };
  const Pose X_WD{{1, 0, 0, 0}, {0, 0, -3e-3}};
  for (int i = 0; i < 500; ++i) loop.tick(X_WD, scene);
  const double before_N = loop.on_hand().force_N.z;
  EXPECT_GT(before_N, 1.9);
  surface_m = 1.5e-3;
  std::vector<Row> now;
  scene(loop.touching().X_WP, now);
  recess_m = unmade_depth_m(now[0], loop.touching().X_WP, loop.touching().X_WP, 5e-6);
  EXPECT_NEAR(recess_m, 1.5e-3, 1e-8);
  loop.tick(X_WD, scene);
  EXPECT_NEAR(loop.on_hand().force_N.z, before_N, 1e-3);
  EXPECT_NEAR(loop.touching().X_WP.p.z, surface_m, 1e-8);
  // Let in, it comes as force.
  while (recess_m > 0) {
    loop.tick(X_WD, scene);
    recess_m = std::max(0.0, recess_m - 0.09 / 1000);
  }
  for (int i = 0; i < 500; ++i) loop.tick(X_WD, scene);
  EXPECT_NEAR(loop.on_hand().force_N.z, before_N + 1.5e-3 * 2000 * 1000 / 3000, 0.02);
}

TEST(Recess, WallsThatLeaveNoRoomAreCalmAndSaySoWithoutIt) {
  for (const bool has_recess : {true, false}) {
    RowLoop loop({}, {2000, 1, 5, 0.005}, one_pad(2000), 1e-3, {});
    const test_support::Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
      for (const double side : {-1.0, 1.0}) {
        rows.push_back(test_support::point_on_plane(X_WQ, {}, {side, 0, 0}, 0.1e-3));
        if (has_recess) rows.back().recess_m = 0.1e-3;
      }
      test_support::name_in_order(rows);
    };
    for (int i = 0; i < 500; ++i) loop.tick({}, scene);
    EXPECT_NEAR(loop.normal_sum_N(), has_recess ? 0 : 2 * 0.1e-3 / 3e-6, has_recess ? 1e-9 : 1);
    EXPECT_NEAR(loop.report().proxy_depth_m, 0.1e-3, 1e-9);  // told
    EXPECT_LE(glm::length(loop.on_hand().force_N), 1e-9);
    EXPECT_LE(glm::length(loop.touching().X_WP.p), 1e-9);
  }
}

}  // namespace
}  // namespace farfeel::constraint
