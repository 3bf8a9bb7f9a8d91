// The proxy against true shapes: rounded edges, a textured groove.
#include "haptic_core/constraint/proxy_shift.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/row_loop.h"

namespace farfeel::constraint {
namespace {

using spatial::Pose;
using test_support::RowLoop;
using test_support::Scene;

constexpr tool::CouplingGains kGains{2000, 1, 5, 0.005};

/// A bar along y, 10 mm wide and 8 mm high below z = 0, with rounded edges: outside is above 0.
double distance_m(const glm::dvec3& p, double radius_m, glm::dvec3& outward) {
  const glm::dvec2 q(std::abs(p.x) - 5e-3 + radius_m, std::abs(p.z + 4e-3) - 4e-3 + radius_m);
  const glm::dvec2 side(p.x < 0 ? -1 : 1, p.z < -4e-3 ? -1 : 1);
  glm::dvec2 n;
  double distance = 0;
  if (q.x > 0 && q.y > 0) {
    distance = glm::length(q) - radius_m, n = glm::normalize(q);
  } else if (q.x > q.y) {
    distance = q.x - radius_m, n = {1, 0};
  } else {
    distance = q.y - radius_m, n = {0, 1};
  }
  outward = {side.x * n.x, 0, side.y * n.y};
  return distance;
}

TEST(ProxyShift, SlidesOffRoundedEdgesWithoutGoingInOrHangingInTheAir) {
  for (const double dt_s : {1e-3, 0.2e-3})
    for (const double radius_m : {0.1e-3, 0.5e-3, 2e-3})
      for (const double speed_m_s : {0.02, 0.1}) {
        RowLoop loop({}, kGains, one_pad(2000), dt_s, {{1, 0, 0, 0}, {0, 0, 1e-3}});
        const Scene scene = [&](const Pose& X_WQ, std::vector<Row>& rows) {
          glm::dvec3 nhat;
          const double distance = distance_m(X_WQ.p, radius_m, nhat);
          rows.push_back(test_support::point_on_plane(X_WQ, {}, nhat, glm::dot(nhat, X_WQ.p) - distance));
        };
        // 3 N through coupling and pad, over the edge in 12 mm, and down beside it.
        const double deep_m = 3 * (1.0 / 2000 + 1.0 / 1000);
        double inside_m = 0, in_the_air_m = 0;
        for (double t = 0; t < 0.5 + 12e-3 / speed_m_s + 0.3; t += dt_s) {
          const double along = 12e-3 * std::clamp((t - 0.5) * speed_m_s / 12e-3, 0.0, 1.0);
          loop.tick({{1, 0, 0, 0}, {along, 0, 1e-3 - (1e-3 + deep_m) * std::min(1.0, t / 0.3)}}, scene);
          glm::dvec3 nhat;
          const double distance = distance_m(loop.touching().X_WP.p, radius_m, nhat);
          const double normal_N = loop.normal_sum_N();
          inside_m = std::max(inside_m, -distance - loop.law().row_compliance_m_per_N * normal_N);
          if (normal_N > 0.05) in_the_air_m = std::max(in_the_air_m, distance);
        }
        EXPECT_LE(inside_m, 1e-6) << radius_m << ' ' << speed_m_s << ' ' << dt_s;
        EXPECT_LE(in_the_air_m, 0.1e-3) << radius_m << ' ' << speed_m_s << ' ' << dt_s;
      }
}

/// Two walls at 45 degrees with ridges of 1.5 mm across them, the proxy stroked along: slopes lean it, twice.
TEST(ProxyShift, StaysOnTwoRidgedWallsAtOnce) {
  RowLoop loop({}, kGains, one_pad(2000), 1e-3, {{1, 0, 0, 0}, {0, 0, 1e-3}});
  const auto wall = [](const glm::dvec3& p, double side) {
    const glm::dvec3 nhat = glm::normalize(glm::dvec3(side, 0, 1)), across = glm::cross(nhat, glm::dvec3(0, 1, 0));
    const double wave = 2 * M_PI / 1.5e-3, phase = wave * (glm::dot(across, p) + 0.7 * p.y) + side;
    Row row;
    row.name = side > 0 ? 1 : 2;
    row.nhat_ST_W = nhat;
    row.damping_Ns_per_m = 0.25;
    row.depth_m = 25e-6 * std::sin(phase) - glm::dot(nhat, p);
    row.gradient << 0, 0, 0,
        spatial::to_eigen(25e-6 * wave * std::cos(phase) * (across + glm::dvec3(0, 0.7, 0)) - nhat);
    return row;
  };
  double deepest_m = 0, highest_m = 0;
  for (int i = 0; i < 600; ++i) {
    const double along = 0.1 * std::max(0.0, i * 1e-3 - 0.1), down = std::min(1.0, i / 50.0) * (1e-3 + 3e-3);
    loop.tick({{1, 0, 0, 0}, {0, along, 1e-3 - down}}, [&](const Pose& X_WQ, std::vector<Row>& rows) {
      for (const double side : {1.0, -1.0}) rows.push_back(wall(X_WQ.p, side));
    });
    if (i < 150) continue;
    const glm::dvec3 p = loop.touching().X_WP.p;
    const double deeper_m = std::max(wall(p, 1).depth_m, wall(p, -1).depth_m);
    deepest_m = std::max(deepest_m, deeper_m);
    highest_m = std::max(highest_m, -deeper_m);
  }
  EXPECT_LE(deepest_m, 2e-6);
  EXPECT_LE(highest_m, 60e-6);
}

/// Walls that oppose each other a thousandth aslant: to get out of both it would have to go a hundred millimetres.
TEST(ProxyShift, IsNotSquirtedOutOfASlotThatHasNoRoom) {
  std::vector<Row> rows;
  for (const double side : {-1.0, 1.0})
    rows.push_back(test_support::point_on_plane({}, {}, glm::normalize(glm::dvec3(side, 0, 1e-3)), 0.1e-3));
  const ProxyPose proxy = pushed_out(rows, {}, {{}, {}, {0, 0, 0}, 0});
  EXPECT_LE(glm::length(proxy.X_WP.p), 0.1e-3);
  EXPECT_NEAR(proxy.depth_m, 0.1e-3, 1e-6);
}

TEST(ProxyShift, IsTheToolWhereNothingTouches) {
  const ContactForces none;
  const ProxyStep step{{}, {{1, 0, 0, 0}, {1, 2, 3}}, {0, 0, 0}, 0};
  const ProxyPose proxy = pushed_out({}, none, step);
  EXPECT_EQ(proxy.X_WP.p, step.X_WT.p);
  EXPECT_EQ(proxy.depth_m, 0);
}

}  // namespace
}  // namespace farfeel::constraint
