// Two contacts in one place: when the shallower one gives way.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "haptic_core/contact/assembly.h"

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

/// What is left of the second one's stiffness beside a first that is deeper and pushes along z.
double share_left(Contact second) {
  std::array contacts{contact_at(0, 0, 0.7e-3), second};
  return without_repeats(contacts, kApart_m) == 2 ? contacts[1].material.stiffness_N_per_m / kStiffness_N_per_m : 0;
}

TEST(WithoutRepeats, TheShallowerOfTwoThatPushAlikeInOnePlaceGivesWay) {
  EXPECT_EQ(share_left(contact_at(1.5e-3, 0.25, 0.3e-3)), 0);
  EXPECT_EQ(share_left(contact_at(kApart_m, 0.25, 0.3e-3)), 1) << "another place";
  EXPECT_EQ(share_left(contact_at(1.5e-3, 0.8, 0.3e-3)), 1) << "another way";
}

// A ball over the seam of two pieces of a vault: the piece beyond the seam is left sideways, where it ends.
TEST(WithoutRepeats, OneAtAnEdgeGivesWayToOneThatPushesLessAlike) {
  const double lean_rad = 0.6;  // 34 degrees
  EXPECT_GT(share_left(contact_at(1.5e-3, lean_rad, 0.3e-3)), 0.8) << "two walls of a groove";
  EXPECT_EQ(share_left(contact_at(1.5e-3, lean_rad, 0.3e-3, penetration::kSilhouette)), 0);
  EXPECT_EQ(share_left(contact_at(1.5e-3, 1.1, 0.3e-3, penetration::kSilhouette)), 1) << "an edge on a wall";
  EXPECT_EQ(share_left(contact_at(1.5e-3, lean_rad, 0.9e-3, penetration::kSilhouette)), 1) << "the deeper one";
}

TEST(WithoutRepeats, TheShareOfOneAtAnEdgeIsContinuousInItsDirection) {
  double before = 0;
  for (double lean_rad = 0.5; lean_rad < 1.2; lean_rad += 1e-3) {
    const double share = share_left(contact_at(1.5e-3, lean_rad, 0.3e-3, penetration::kSilhouette));
    EXPECT_GE(share, before);
    EXPECT_LT(share, before + 0.01);
    before = share;
  }
  EXPECT_EQ(before, 1);
}

}  // namespace
}  // namespace farfeel::contact
