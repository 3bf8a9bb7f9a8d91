#include "haptic_core/contact/penalty.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "haptic_core/contact/depth/contact_frame.h"
#include "haptic_core/penetration/reference/reference.h"
#include "tests/support/plates.h"

namespace farfeel::contact {
namespace {

Contact pressed_contact() {
  Contact contact;
  contact.depth_m = 0.3e-3;
  contact.nhat_ST_W = {0, 0, 1};
  contact.gradient << 0.01, -0.02, 0, 0.1, -0.2, -1;
  return contact;
}

TEST(Penalty, NeverPullsHoweverFastTheyPart) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const Contact contact = pressed_contact();
  for (int trial = 0; trial < 1000; ++trial) {
    const double speed = std::pow(10.0, trial % 7 - 3);
    const spatial::Twist V{10 * speed * glm::dvec3{normal(random), normal(random), normal(random)},
                           speed * glm::dvec3{normal(random), normal(random), normal(random)}};
    const spatial::Wrench F = penalty_wrench(contact, V);
    EXPECT_GE(F.force_N.z, 0);
    const spatial::Wrench spring = penalty_wrench(contact, {});
    EXPECT_LE(power_W(F, V) - power_W(spring, V), 1e-12 * speed) << "the damper must not give energy";
  }
}

TEST(Penalty, IsNothingApartAndGrowsFromNothingAtFirstTouch) {
  Contact contact = pressed_contact();
  const spatial::Twist fast{{0, 0, 0}, {0, 0, -1}};
  contact.depth_m = -1e-9;
  EXPECT_EQ(penalty_wrench(contact, fast), spatial::Wrench{});
  EXPECT_EQ(penalty_energy_J(contact), 0);
  contact.depth_m = 1e-9;
  EXPECT_LT(glm::length(penalty_wrench(contact, fast).force_N), 1e-5);
}

/// A cluster whose frame is frozen, felt through the reference at poses around X_WT.
class FrozenCluster {
 public:
  FrozenCluster()
      : s_surface_(
            support::textured_plate({}, [](double x, double y) { return 0.1e-3 * std::cos(2e3 * x + 1e3 * y); })),
        t_surface_(support::textured_plate({.width_m = 0.006, .depth_m = 0.005},
                                           [](double x, double y) { return 0.1e-3 * std::cos(1.5e3 * y - 800 * x); })) {
    cluster_.nhat_ST_S = glm::normalize(glm::dvec3{0.05, -0.03, 1});
    X_WS_ = {spatial::rotation_from_vector({0.4, 1.1, -0.3}), {0.2, -0.1, 0.3}};
  }

  [[nodiscard]] spatial::Pose initial_X_WT() const {
    return X_WS_ * spatial::Pose{spatial::rotation_from_vector({0.01, -0.02, 0}) * glm::dquat{0, 1, 0, 0},
                                 {0.3e-3, -0.2e-3, -0.1e-3}};
  }

  [[nodiscard]] Contact at(const spatial::Pose& X_WT) {
    const spatial::Pose X_CS = spatial::inverse(contact_frame(cluster_));
    const penetration::Query query{.s = {&s_, X_CS, triangles_},
                                   .t = {&t_, X_CS * (spatial::inverse(X_WS_) * X_WT), triangles_},
                                   .window = {{-0.006, -0.006}, {0.006, 0.006}},
                                   .wants_hessian = true};
    penetration::Penetration depth;
    back_end_->evaluate({&query, 1}, {&depth, 1});
    hessian_W = turned(depth.hessian, (X_WS_ * contact_frame(cluster_)).R);
    return contact_from(cluster_, depth, X_WS_, X_WT.p);
  }

  spatial::Matrix6 hessian_W;

 private:
  geometry::HapticSurface s_surface_, t_surface_;
  penetration::FeltSurface s_{s_surface_}, t_{t_surface_};
  std::vector<std::uint32_t> triangles_{0, 1};
  Cluster cluster_;
  spatial::Pose X_WS_;
  std::unique_ptr<penetration::BackEnd> back_end_ = penetration::make_reference({.coarse_triangles = 8});
};

spatial::Pose moved(const spatial::Pose& X_WT, const spatial::Vector6& q) {
  return {glm::normalize(spatial::rotation_from_vector({q[0], q[1], q[2]}) * X_WT.R),
          X_WT.p + glm::dvec3{q[3], q[4], q[5]}};
}

TEST(Penalty, WrenchIsTheNegativeGradientOfTheEnergyAndStiffnessItsDerivative) {
  FrozenCluster cluster;
  const spatial::Pose X_WT = cluster.initial_X_WT();
  const Contact contact = cluster.at(X_WT);
  ASSERT_GT(contact.depth_m, 0);
  const spatial::Vector6 F = spatial::to_vector6(penalty_wrench(contact, {}));
  const spatial::Matrix6 K = penalty_stiffness(contact, cluster.hessian_W);
  for (int k = 0; k < 6; ++k) {
    const double h = k < 3 ? 1e-7 : 1e-9;
    const Contact up = cluster.at(moved(X_WT, h * spatial::Vector6::Unit(k)));
    const Contact down = cluster.at(moved(X_WT, -h * spatial::Vector6::Unit(k)));
    EXPECT_NEAR(F[k], -(penalty_energy_J(up) - penalty_energy_J(down)) / (2 * h), 1e-6 * F.norm()) << k;
    if (k < 3) continue;  // rotations do not commute: their differences carry an antisymmetric part
    const spatial::Vector6 slope =
        spatial::to_vector6(penalty_wrench(up, {})) - spatial::to_vector6(penalty_wrench(down, {}));
    EXPECT_LT((K.col(k) + slope / (2 * h)).tail<3>().norm(), 1e-3 * K.norm()) << k;
  }
}

}  // namespace
}  // namespace farfeel::contact
