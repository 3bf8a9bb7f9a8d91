// Two contacts in one place: when the shallower one gives way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptic_core/contact/depth/duplicate_weights.h"
#include "haptic_core/penetration/penetration.h"

namespace farfeel::contact {
namespace {

constexpr double kStiffness_N_per_m = 1000, kApart_m = 4e-3;

/// At a place along x, pushing along a direction that leans from z towards x.
Contact contact_at(double x_m, double lean_rad, double depth_m, std::uint8_t doubts = 0) {
  Contact c;
  c.p_WC_W = {x_m, 0, 0};
  c.nhat_ST_W = {std::sin(lean_rad), 0, std::cos(lean_rad)};
  c.gradient.tail<3>() = -spatial::to_eigen(c.nhat_ST_W);
  c.depth_m = depth_m;
  c.doubts = doubts;
  c.material.stiffness_N_per_m = kStiffness_N_per_m;
  return c;
}

constexpr double kTick_s = 1e-3;
const Contact kFirst = contact_at(0, 0, 0.7e-3);

/// What is left of the second one's stiffness beside a first that is deeper and pushes along z, the tool having come a
/// way along x since the answer before.
double share_left(DuplicateWeights& repeats, Contact second, double way_m = 0) {
  ContactSet set;
  set.count = 2;
  set.contacts[0] = kFirst, set.contacts[1] = second;
  set.contacts[0].id = 1, set.contacts[1].id = 2;
  repeats.fade(set, {{1, 0, 0, 0}, {-way_m, 0, 0}}, {}, kTick_s);
  return set.count == 2 ? set.contacts[1].material.stiffness_N_per_m / kStiffness_N_per_m : 0;
}
/// As soon as there are two.
double share_left(const Contact& second) {
  DuplicateWeights fresh(kApart_m);
  return share_left(fresh, second);
}

TEST(DuplicateWeights, TheShallowerOfTwoThatPushAlikeInOnePlaceGivesWay) {
  EXPECT_EQ(share_left(contact_at(1.5e-3, 0.25, 0.3e-3)), 0);
  EXPECT_EQ(share_left(contact_at(kApart_m, 0.25, 0.3e-3)), 1) << "another place";
  EXPECT_EQ(share_left(contact_at(1.5e-3, 0.8, 0.3e-3)), 1) << "another way";
}

/// Of the second contact's spring, while the tool swings four times to and fro and the contact's point goes ten times
/// as far: deepest a quarter of a swing after it is nearest to the first one.
struct Swing {
  double least_share = 1, most_share = 0;
  double made_J = 0;  ///< work on the tool
};
Swing swing(bool forgets) {
  constexpr double kSwing_m = 50e-6, kTurn = 2 * std::numbers::pi;
  constexpr int kTicks = 31;  // to and fro: 32 Hz
  DuplicateWeights repeats(kApart_m);
  Swing done;
  double force_before_N = 0;
  const auto x_m = [](int i) { return kSwing_m * std::sin(kTurn * i / kTicks); };
  const auto depth_m = [](int i) { return 0.6e-3 - kSwing_m * std::cos(kTurn * i / kTicks); };
  for (int i = 0; i <= 4 * kTicks; ++i) {
    if (forgets) repeats.restart();
    const double share = share_left(repeats, contact_at(3e-3 + 10 * x_m(i), 0.25, depth_m(i)), x_m(i) - x_m(i - 1));
    const double force_N = kStiffness_N_per_m * share * depth_m(i);
    if (i > 0) done.made_J -= 0.5 * (force_N + force_before_N) * (depth_m(i) - depth_m(i - 1));
    done.least_share = std::min(done.least_share, share), done.most_share = std::max(done.most_share, share);
    force_before_N = force_N;
  }
  return done;
}

// What is stored by how much two are one is no part of what their springs push with.
TEST(DuplicateWeights, ASwingInASmallPlaceFindsTheSpringsAsTheyWere) {
  const Swing anew = swing(true), kept = swing(false);
  ASSERT_GT(anew.most_share - anew.least_share, 0.5);
  ASSERT_GT(std::abs(anew.made_J), 50e-6);
  EXPECT_LT(kept.most_share - kept.least_share, 0.1);
  EXPECT_LT(std::abs(kept.made_J), 0.05 * std::abs(anew.made_J));
}

TEST(DuplicateWeights, AStrokeLeavesThePlaceBehind) {
  DuplicateWeights repeats(kApart_m);
  constexpr double kStep_m = 20e-6;  // 100 mm/s at 5 kHz
  double before = share_left(repeats, contact_at(1.5e-3, 0.25, 0.3e-3), kStep_m);
  EXPECT_EQ(before, 0);
  for (double way_m = 0; way_m < 6e-3; way_m += kStep_m) {
    const double share = share_left(repeats, contact_at(kApart_m, 0.25, 0.3e-3), kStep_m);
    EXPECT_GE(share, before);
    EXPECT_LT(share, before + 0.1) << "at once";
    before = share;
  }
  EXPECT_GT(before, 0.99);
}

TEST(DuplicateWeights, AToolThatRestsFindsItsPlaceInTime) {
  DuplicateWeights repeats(kApart_m);
  (void)share_left(repeats, contact_at(1.5e-3, 0.25, 0.3e-3));
  double share = 0;
  for (int i = 0; i < 3000; ++i) share = share_left(repeats, contact_at(kApart_m, 0.25, 0.3e-3));
  EXPECT_GT(share, 0.99);
}

TEST(DuplicateWeights, OneThatDidNotPressIsTakenAsItIs) {
  DuplicateWeights repeats(kApart_m);
  (void)share_left(repeats, contact_at(1.5e-3, 0.25, -0.1e-3));
  EXPECT_EQ(share_left(repeats, contact_at(kApart_m, 0.25, 0.3e-3)), 1);
}

}  // namespace
}  // namespace farfeel::contact
