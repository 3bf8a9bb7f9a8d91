#include "haptic_core/contact_service/proxy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/models/models.h"
#include "tests/support/solids.h"

namespace farfeel::contact_service {
namespace {

constexpr double kRadius_m = 3e-3;  // of the ball

/// A plate of this thickness whose top is at z = 0, and a ball of 6 mm.
struct BallOnPlate {
  geometry::HapticSurface plate, ball = support::untextured(slave_sim::probe_base());
  ContactService service;

  explicit BallOnPlate(double thickness_m, const motion::ScriptedMotion* motion = nullptr)
      : plate(support::untextured(support::box_mesh({0.06, 0.06, thickness_m}))),
        service(service_of(plate, ball, {{1, 0, 0, 0}, {0, 0, -0.5 * thickness_m}}, motion)) {}

  static ContactService service_of(const geometry::HapticSurface& plate, const geometry::HapticSurface& ball,
                                   const spatial::Pose& X_WO, const motion::ScriptedMotion* motion) {
    const TouchableObject object{.felt = &plate, .material = {}, .X_WO = X_WO, .motion = motion};
    return {{&object, 1}, {.felt = &ball, .material = {}, .X_WO = {}}, {}};
  }
  /// The ball's lowest point is at p_W.
  const Answer& at(const glm::dvec3& p_W, std::int64_t time_ns) {
    return service.answer(
        {.time_ns = time_ns, .X_WT = {{1, 0, 0, 0}, p_W + glm::dvec3(0, 0, kRadius_m)}, .V_WT_W = {}});
  }
};

double deepest_m(const contact::ContactSet& set) {
  double most_m = -1;
  for (std::uint32_t i = 0; i < set.count; ++i) most_m = std::max(most_m, set.contacts[i].depth_m);
  return most_m;
}

TEST(Proxy, HoweverDeepTheHandSinksTheWallStaysInFrontOfIt) {
  for (const double thickness_m : {0.5e-3, 1e-3, 3e-3, 20e-3}) {
    for (const double way_m : {0.05e-3, 1e-3, 4e-3, 12e-3}) {  // in an answer
      BallOnPlate scene(thickness_m);
      double depth_m = -10e-3;
      for (int i = 0; depth_m < 30e-3; ++i, depth_m += way_m) {
        const contact::ContactSet& set = scene.at({0.3e-3, 0.2e-3, -depth_m}, 1'000'000LL * i);
        if (depth_m < 0.1e-3) continue;
        EXPECT_NEAR(deepest_m(set), depth_m, 0.06e-3) << thickness_m << " m thick, " << way_m << " m an answer";
        EXPECT_GT(set.F_To_W.force_N.z, 900 * (depth_m - 0.1e-3)) << depth_m << " m deep";
        EXPECT_LT(glm::length(glm::dvec2(set.F_To_W.force_N)), 0.1 * set.F_To_W.force_N.z);
      }
    }
  }
}

TEST(Proxy, AShallowToolIsItsOwnProxy) {
  BallOnPlate scene(3e-3);
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(scene.at({1e-4 * i, 0, 0.5e-3 * std::sin(0.1 * i)}, 1'000'000LL * i).p_PT_W, glm::dvec3(0)) << i;
  }
}

TEST(Proxy, OverTheEdgeTheToolIsLetGoOfWithoutAJump) {
  BallOnPlate scene(3e-3);
  double last_N = 0;
  glm::dvec3 p_PT_W{1};
  int i = 0;
  const auto go = [&](double x_m, double depth_m) {
    const Answer& set = scene.at({x_m, 0, -depth_m}, 1'000'000LL * i++);
    p_PT_W = set.p_PT_W;
    const double force_N = glm::length(set.F_To_W.force_N);
    EXPECT_LT(std::abs(force_N - last_N), 1.5) << x_m << " " << depth_m;
    last_N = force_N;
  };
  for (int k = -20; k <= 100; ++k) go(0.02, 0.05e-3 * k);
  EXPECT_GT(last_N, 4.5);
  for (int k = 0; k <= 1500; ++k) go(0.02 + 0.01e-3 * k, 5e-3);
  for (int k = 0; k < 200; ++k) go(0.035, 5e-3);
  EXPECT_EQ(p_PT_W, glm::dvec3(0));
  EXPECT_EQ(last_N, 0);
}

TEST(Proxy, AWayThatIsUnknownIsNotWalked) {
  BallOnPlate scene(3e-3);
  EXPECT_EQ(scene.at({0, 0, 0.01}, 0).F_To_W, spatial::Wrench{});
  const Answer& there = scene.at({0, 0, -0.5}, 100'000'000);
  EXPECT_EQ(there.count, 0u) << "half a metre in one answer";
  EXPECT_EQ(there.p_PT_W, glm::dvec3(0));
}

TEST(Proxy, AfterARestartTheToolIsWhereItIs) {
  BallOnPlate scene(3e-3);
  static_cast<void>(scene.at({0, 0, 0.01}, 0));
  scene.service.restart();
  EXPECT_EQ(scene.at({0, 0, -0.0101}, 1'000'000).F_To_W, spatial::Wrench{}) << "clear, below the plate";
}

/// The plate comes up by 8 mm in a tenth of a second under a ball that stands still, and goes back.
TEST(Proxy, AnObjectThatMovesTakesItAlong) {
  const auto at_z = [](double at_s, double z_m) {
    return motion::Keyframe{at_s, {{1, 0, 0, 0}, {0, 0, -1.5e-3 + z_m}}};
  };
  const std::array keys{at_z(0, -2e-3), at_z(0.1, 6e-3), at_z(0.2, -2e-3)};
  const motion::ScriptedMotion script(keys, motion::Afterwards::kStays);
  BallOnPlate scene(3e-3, &script);
  glm::dvec3 p_PT_W{1};
  for (int i = 0; i <= 220; ++i) {
    const double top_m = script.at(1e-3 * i).X_WO.p.z + 1.5e-3;
    const Answer& set = scene.at({0, 0, 0}, 1'000'000LL * i);
    p_PT_W = set.p_PT_W;
    if (std::abs(top_m) > 0.1e-3) {
      EXPECT_NEAR(deepest_m(set), top_m, 0.1e-3) << i;
    }
  }
  EXPECT_EQ(p_PT_W, glm::dvec3(0));
}

}  // namespace
}  // namespace farfeel::contact_service
