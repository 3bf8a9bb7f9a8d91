#include "haptic_core/contact/handover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "haptic_core/contact/penalty.h"

namespace farfeel::contact {
namespace {

constexpr double kTick_s = 1e-3;
constexpr int kRamp = 20;  // ticks

/// A wall that pushes along slope, as deep as it says at the pose of the set.
Contact wall(std::uint32_t id, double depth_m, const glm::dvec3& n = {0, 0, 1}) {
  Contact c;
  c.id = id;
  c.nhat_ST_W = n;
  c.depth_m = depth_m;
  c.gradient = spatial::to_vector6(spatial::Wrench{{0, 0, 0}, -n});
  return c;
}

struct Told {
  Contact contact;
  std::uint64_t made_from = 1;
};

class Hand {
 public:
  const ContactSet& tell(std::initializer_list<Told> contacts, const glm::dvec3& p_WT = {0, 0, 0}) {
    set_.X_WT.p = p_WT;
    set_.count = 0;
    std::array<Making, kMaxContacts> makings;
    for (const Told& told : contacts) {
      set_.contacts[set_.count] = told.contact;
      makings[set_.count++] = {.id = told.contact.id,
                               .made_from = told.made_from,
                               .is_provisional = false,
                               .is_coarse = false,
                               .material = Material{}};
    }
    handover.apply(set_, {makings.data(), set_.count}, {}, kTick_s);
    return set_;
  }
  [[nodiscard]] double force_N(int axis = 2) const {
    double sum = 0;
    for (std::uint32_t i = 0; i < set_.count; ++i) sum += penalty_wrench(set_.contacts[i], {}).force_N[axis];
    return sum;
  }
  [[nodiscard]] double energy_J() const {
    double sum = 0;
    for (std::uint32_t i = 0; i < set_.count; ++i) sum += penalty_energy_J(set_.contacts[i]);
    return sum;
  }
  Handover handover;

 private:
  ContactSet set_;
};

/// Clusters may be made anew in every answer, above all in fast ones: a name is no contact.
TEST(Handover, AContactThatOnlyChangesItsNameKeepsItsForce) {
  Hand hand;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const double depth_m = 0.7e-3 + 20e-6 * std::sin(0.9 * i);
    const ContactSet& set = hand.tell({{wall(1 + i, depth_m), 1 + i / 3}, {wall(1000, 0.5e-3, {1, 0, 0})}});
    ASSERT_EQ(set.count, 2u);
    EXPECT_DOUBLE_EQ(hand.force_N(), Material{}.stiffness_N_per_m * depth_m);
    EXPECT_DOUBLE_EQ(hand.force_N(0), Material{}.stiffness_N_per_m * 0.5e-3);
    EXPECT_EQ(hand.handover.handed(), 0u);
  }
}

TEST(Handover, LeavesAloneWhatIsMadeOfTheSame) {
  Hand hand;
  for (int i = 0; i < 50; ++i) {
    const double depth_m = 1e-3 * std::sin(0.9 * i);  // as a ridge under a fast tool
    const ContactSet& set = hand.tell({{wall(1, depth_m)}}, {0.3e-3 * i, 0, 0});
    ASSERT_EQ(set.count, 1u);
    EXPECT_EQ(set.contacts[0].depth_m, depth_m);
    EXPECT_EQ(set.contacts[0].material.stiffness_N_per_m, Material{}.stiffness_N_per_m);
    EXPECT_EQ(set.contacts[0].doubts, 0);
    EXPECT_EQ(hand.handover.handed(), 0u);
  }
}

TEST(Handover, WhatNoSurfaceIsSteepEnoughForIsHandedOverToo) {
  Hand hand;
  hand.tell({{wall(1, 1e-3)}});
  double last_N = hand.force_N();
  for (int i = 1; i <= 2; ++i) {
    hand.tell({{wall(1, -1e-3)}}, {10e-6 * i, 0, 0});
    EXPECT_GT(hand.force_N(), last_N - 0.35) << i;
    last_N = hand.force_N();
  }
}

/// Half a millimetre further its line would say 2.1 mm.
TEST(Handover, WhatLeavesIsHardlyDeeperThanItWasHoweverSteepAndFar) {
  Hand hand;
  Contact steep = wall(1, 0.1e-3);
  steep.gradient *= 4;
  hand.tell({{steep}});
  const ContactSet& set = hand.tell({{wall(1, 0.05e-3), 2}}, {0, 0, -0.5e-3});
  for (std::uint32_t i = 0; i < set.count; ++i) EXPECT_LT(set.contacts[i].depth_m, 0.2e-3) << set.contacts[i].id;
}

TEST(Handover, ASmallChangeIsOverInAFewMilliseconds) {
  Hand hand;
  hand.tell({{wall(1, 1e-3)}});
  for (int i = 1; i <= 3; ++i) hand.tell({{wall(1, 1.2e-3), 2}});  // 0.4 N
  EXPECT_NEAR(hand.force_N(), 2.4, 1e-12);
  EXPECT_EQ(hand.handover.handed(), 0u);
}

TEST(Handover, OfAContactMadeAnewIsContinuousAndOverWithinTheRamp) {
  Hand hand;
  hand.tell({{wall(1, 1e-3)}});
  const double before_N = hand.force_N();
  double last_N = before_N;
  for (int i = 1; i <= kRamp + 1; ++i) {
    hand.tell({{wall(1, 3e-3), 2}});
    EXPECT_LT(std::abs(hand.force_N() - last_N), 0.25) << i;
    EXPECT_GE(hand.force_N(), last_N - 1e-12) << i;
    EXPECT_LE(hand.force_N(), 3 * before_N + 1e-12) << i;
    last_N = hand.force_N();
  }
  EXPECT_NEAR(last_N, 3 * before_N, 1e-12);
  EXPECT_EQ(hand.handover.handed(), 0u);
}

TEST(Handover, ADirectionThatTurnsAtOnceTurnsAlongTheRamp) {
  Hand hand;
  hand.tell({{wall(1, 1e-3)}});
  double last_x = 0, last_z = hand.force_N();
  for (int i = 1; i <= kRamp + 1; ++i) {
    hand.tell({{wall(1, 1e-3, {1, 0, 0}), 2}});
    EXPECT_LT(std::hypot(hand.force_N(0) - last_x, hand.force_N(2) - last_z), 0.25) << i;
    last_x = hand.force_N(0), last_z = hand.force_N(2);
  }
  EXPECT_NEAR(last_x, 2, 1e-12);
  EXPECT_NEAR(last_z, 0, 1e-12);
}

TEST(Handover, WhatIsGoneFadesAndPushesNoHarderMeanwhile) {
  Hand hand;
  hand.tell({{wall(1, 1e-3)}});
  double last_N = hand.force_N();
  for (int i = 0; i <= kRamp + 1; ++i) {
    hand.tell({}, {0, 0, -1e-4 * i});  // pressing on
    EXPECT_LE(hand.force_N(), last_N) << i;
    EXPECT_GT(hand.force_N(), last_N - 0.21) << i << ": 0.2 N a millisecond";
    last_N = hand.force_N();
  }
  EXPECT_EQ(last_N, 0);
}

TEST(Handover, WhatAppearsDeepComesInAlongTheRamp) {
  Hand hand;
  hand.tell({{wall(1, -1e-3)}});
  double last_N = 0;
  for (int i = 0; i <= kRamp + 1; ++i) {
    hand.tell({{wall(1, -1e-3)}, {wall(2, 5e-3, {1, 0, 0})}});
    EXPECT_GE(hand.force_N(0), last_N);
    EXPECT_LT(hand.force_N(0) - last_N, 0.51) << i << ": 10 N in 20 ms";
    last_N = hand.force_N(0);
  }
  EXPECT_NEAR(last_N, 10, 1e-12);
}

TEST(Handover, WhatAppearsWhereAnotherPushedTakesItsPartOver) {
  Hand hand;
  hand.tell({{wall(1, 1e-3)}});
  double last_N = hand.force_N();
  for (int i = 1; i <= kRamp + 1; ++i) {
    hand.tell({{wall(2, 1e-3), 2}});  // under another name
    EXPECT_NEAR(hand.force_N(), last_N, 0.25) << i;
    last_N = hand.force_N();
  }
  EXPECT_NEAR(last_N, 2, 1e-12);
}

TEST(Handover, ARealWallIsNeitherLateNorWeak) {
  Hand hand;
  for (int i = 0; i <= 30; ++i) {  // at 0.3 m/s into a wall that is first told of when it is 3 mm away
    const double depth_m = 0.3e-3 * i - 3e-3;
    hand.tell({{wall(1, depth_m)}}, {0, 0, -0.3e-3 * i});
    EXPECT_NEAR(hand.force_N(), 2000 * std::max(depth_m, 0.0), 1e-9) << i;
  }
  Hand at_once;  // and one that is told of when it is met
  at_once.tell({{wall(1, -1e-3)}});
  at_once.tell({{wall(1, -1e-3)}, {wall(2, 0.25e-3, {1, 0, 0})}}, {-0.3e-3, 0, 0});
  EXPECT_NEAR(at_once.force_N(0), 0.5, 1e-9);
}

// What is told as made is the whole difference between the stored energy and the work of the tool's way.
TEST(Handover, TellsEveryEnergyThatTheWayDidNotBring) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Hand hand;
  glm::dvec3 p{0, 0, 0};
  const auto force = [](const Hand& h) { return glm::dvec3{h.force_N(0), h.force_N(1), h.force_N(2)}; };
  hand.tell({{wall(1, 1e-3)}, {wall(2, 0.5e-3, {1, 0, 0})}});
  double made_J = 0, work_J = 0;
  const double first_J = hand.energy_J();
  for (int i = 0; i < 200; ++i) {
    const glm::dvec3 step = 20e-6 * glm::dvec3{uniform(random), uniform(random), uniform(random)};
    p += step;
    const double offset_m = i % 37 < 18 ? 0 : 0.8e-3;  // made anew now and then
    const Contact a = wall(1, 1e-3 + offset_m - p.z), b = wall(2, 0.5e-3 - p.x, {1, 0, 0});
    const glm::dvec3 before_N = force(hand);
    i % 50 == 0 ? hand.tell({{a, 1u + (i % 37 < 18)}}, p) : hand.tell({{a, 1u + (i % 37 < 18)}, {b}}, p);
    work_J -= 0.5 * glm::dot(before_N + force(hand), step);
    made_J += hand.handover.made_J();
  }
  EXPECT_NEAR(hand.energy_J(), first_J + work_J + made_J, 1e-12);
  EXPECT_GT(std::abs(made_J), 1e-5);
}

}  // namespace
}  // namespace farfeel::contact
