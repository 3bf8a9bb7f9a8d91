#include "haptic_core/local_model/felt_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "haptic_core/local_model/constants.h"

namespace farfeel::local_model {
namespace {

using spatial::Pose;
using spatial::Twist;
using spatial::Vector6;

class FeltContactTest : public ::testing::Test {
 protected:
  glm::dvec3 vector(double size) { return size * glm::dvec3(uniform_(random_), uniform_(random_), uniform_(random_)); }
  Pose pose(double angle, double length) { return {spatial::rotation_from_vector(vector(angle)), vector(length)}; }

  /// A contact with a slope across its direction and a couple of its own.
  contact::Contact contact(const Pose& X0_WT) {
    contact::Contact contact;
    contact.p_WC_W = X0_WT.p + vector(0.05);
    contact.nhat_ST_W = glm::normalize(vector(1));
    contact.depth_m = 0.001 * uniform_(random_);
    const glm::dvec3 v = vector(0.8);
    const glm::dvec3 by_translation = v - glm::dot(v, contact.nhat_ST_W) * contact.nhat_ST_W - contact.nhat_ST_W;
    contact.gradient =
        spatial::to_vector6(Twist{glm::cross(contact.p_WC_W - X0_WT.p, by_translation) + vector(1e-3), by_translation});
    contact.lateral_range_m = 0.0005;
    return contact;
  }

  std::mt19937 random_{3};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

TEST_F(FeltContactTest, IsWhatTheRemoteSaidAtThePoseItWasSaidFor) {
  for (int i = 0; i < 100; ++i) {
    const Pose X0 = pose(2, 1);
    const contact::Contact said = contact(X0);
    const auto sample = felt_contact(said, X0).sample(X0);
    EXPECT_NEAR(sample.depth_m, said.depth_m, 1e-15);
    EXPECT_LE((sample.gradient - said.gradient).norm(), 1e-12);
  }
}

TEST_F(FeltContactTest, GradientIsTheDepthsDerivativeInsideAndOutsideTheLateralRange) {
  for (int i = 0; i < 200; ++i) {
    const Pose X0 = pose(2, 1);
    const FeltContact felt = felt_contact(contact(X0), X0);
    const Pose X = spatial::integrate(X0, {vector(0.01), vector(i % 2 == 0 ? 0.0002 : 0.003)}, 1);
    const auto here = felt.sample(X);
    for (int axis = 0; axis < 6; ++axis) {
      constexpr double kStep = 1e-7;
      const auto at = [&](double step) {
        const Vector6 d = step * Vector6::Unit(axis);
        return felt.sample(spatial::integrate(X, spatial::twist_from(d), 1)).depth_m;
      };
      EXPECT_NEAR((at(kStep) - at(-kStep)) / (2 * kStep), here.gradient[axis], 1e-6);
    }
  }
}

TEST_F(FeltContactTest, ABentContactsGradientIsItsDepthsDerivativeToo) {
  for (int i = 0; i < 200; ++i) {
    const Pose X0 = pose(2, 1);
    contact::Contact said = contact(X0);
    said.gradient.head<3>() =
        spatial::to_eigen(glm::cross(said.p_WC_W - X0.p, spatial::twist_from(said.gradient).linear_m_s));
    const spatial::Matrix6 half = 20 * spatial::Matrix6::NullaryExpr([&] { return uniform_(random_); });
    said.curvature = contact::Curvature::of(half + half.transpose());
    const FeltContact felt = felt_contact(said, X0);
    ASSERT_TRUE(felt.received.is_bent());
    const Pose X = spatial::integrate(X0, {vector(2e-4), vector(i % 2 == 0 ? 0.0002 : 0.003)}, 1);
    const auto here = felt.sample(X);
    const auto at = [&](int axis, double step) {
      const Vector6 d = step * Vector6::Unit(axis);
      return felt.sample(spatial::integrate(X, spatial::twist_from(d), 1));
    };
    for (int axis = 0; axis < 6; ++axis) {
      constexpr double kStep = 1e-7;
      EXPECT_NEAR((at(axis, kStep).depth_m - at(axis, -kStep).depth_m) / (2 * kStep), here.gradient[axis], 1e-5);
    }
    // At X0 the gradient turns as the remote said.
    for (int axis = 3; axis < 6; ++axis) {
      const Vector6 d = 1e-6 * Vector6::Unit(axis);
      const auto there = felt.sample(spatial::integrate(X0, spatial::twist_from(d), 1));
      const glm::dvec3 n = said.nhat_ST_W;
      const Vector6 turned = (there.gradient - felt.sample(X0).gradient) / 1e-6;
      const Eigen::Vector3d across =
          turned.tail<3>() - spatial::to_eigen(n) * spatial::to_eigen(n).dot(turned.tail<3>());
      const Eigen::Vector3d nn = spatial::to_eigen(n);
      const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - nn * nn.transpose();
      const Eigen::Vector3d wanted = P * said.curvature.matrix().bottomRightCorner<3, 3>() * P.col(axis - 3);
      EXPECT_LT((across - wanted).norm(), 1e-2 * (1 + wanted.norm()));
    }
  }
}

/// What a point of the tool at p says of the surface z = height(x), of that slope there.
FeltContact answer_of(const glm::dvec3& p, double height_m, double slope) {
  contact::Contact said;
  said.nhat_ST_W = {0, 0, 1};
  said.p_WC_W = p;
  said.depth_m = height_m - p.z;
  said.gradient = spatial::to_vector6(Twist{{0, 0, 0}, {slope, 0, -1}});
  said.lateral_range_m = 0.2e-3;
  return felt_contact(said, {{1, 0, 0, 0}, p});
}

TEST_F(FeltContactTest, InAGrooveTwoAnswersTellHowItsSlopeTurnsOn) {
  constexpr double kBend_per_m = 5000;  // of z = kBend_per_m x^2 / 2
  const auto in_groove = [&](double x) { return answer_of({x, 0, 0}, 0.5 * kBend_per_m * x * x, kBend_per_m * x); };
  FeltContact felt = in_groove(30e-6);
  felt.received = bent_as_seen(felt.received, in_groove(-20e-6).received);
  for (const double x : {-60e-6, 30e-6, 100e-6}) {
    const auto there = felt.sample({{1, 0, 0, 0}, {x, 0, 0}});
    EXPECT_NEAR(there.depth_m, 0.5 * kBend_per_m * x * x, 1e-12) << x;
    EXPECT_NEAR(there.gradient[3], kBend_per_m * x, 1e-9) << x;
  }
  // Not further than it was seen to turn, twice.
  EXPECT_NEAR(felt.sample({{1, 0, 0, 0}, {0.05, 0, 0}}).depth_m, felt.sample({{1, 0, 0, 0}, {0.06, 0, 0}}).depth_m,
              1e-12);
}

TEST_F(FeltContactTest, WhatTwoAnswersDoNotTellIsNotBent) {
  const FeltContact flat = answer_of({30e-6, 0, 0}, 0, 0.2);
  const auto is_bent_after = [&](FeltContact older) {
    FeltContact felt = flat;
    felt.received = bent_as_seen(felt.received, older.received);
    return felt.received.is_bent();
  };
  EXPECT_TRUE(is_bent_after(answer_of({0, 0, 0}, 0, 0.1)));
  EXPECT_FALSE(is_bent_after(answer_of({0, 0, 0}, 0, 0.2)));      // a plane
  EXPECT_FALSE(is_bent_after(answer_of({0, 0, 0}, 0, 0.3)));      // a ridge
  EXPECT_FALSE(is_bent_after(answer_of({30e-6, 0, 0}, 0, 0.1)));  // no way between them
  FeltContact elsewhere = answer_of({0, 0, 0}, 0, 0.1);
  elsewhere.received.contact.p_WC_W.y += 0.01;  // on the tool
  EXPECT_FALSE(is_bent_after(elsewhere));
  FeltContact steep = answer_of({0, 0, 0}, 0, -2);
  FeltContact felt = answer_of({2e-6, 0, 0}, 0, 2);
  felt.received = bent_as_seen(felt.received, steep.received);
  EXPECT_LE(felt.sample({{1, 0, 0, 0}, {0.05, 0, 0}}).gradient[3], 2 * kMaxSlope);
}

TEST_F(FeltContactTest, BeyondTheLateralRangeTheSlopeRisesNoFurther) {
  contact::Contact said;
  said.nhat_ST_W = {0, 0, 1};
  said.gradient = spatial::to_vector6(Twist{{0, 0, 0}, {0.5, 0, -1}});
  said.lateral_range_m = 0.0004;
  const FeltContact felt = felt_contact(said, {});
  const auto depth_at = [&](double x) { return felt.sample({{1, 0, 0, 0}, {x, 0, 0}}).depth_m; };
  EXPECT_NEAR(depth_at(0.0004), 0.0002, 1e-15);
  EXPECT_NEAR(depth_at(0.05), 0.0002, 1e-15);
  EXPECT_NEAR(depth_at(-0.05), -0.0002, 1e-15);
}

TEST_F(FeltContactTest, AWallBesideTheContactIsNotTakenForItsTexture) {
  contact::Contact said;
  said.nhat_ST_W = {0, 0, 1};
  said.gradient = spatial::to_vector6(Twist{{0, 3, 0}, {12, 16, -1}});
  said.lateral_range_m = 0.001;
  const auto sample = felt_contact(said, {}).sample({});
  EXPECT_NEAR(sample.gradient.tail<3>().norm(), std::hypot(kMaxSlope, 1), 1e-12);
  EXPECT_EQ(sample.gradient.head<3>().norm(), 0);  // the contact is at To: no arm, and a wall's couple is not believed
}

TEST_F(FeltContactTest, AFlatContactIsAPlaneHoweverFarTheToolTurns) {
  contact::Contact said;
  said.nhat_ST_W = {0, 0, 1};
  said.p_WC_W = {0.1, 0, 0};
  said.gradient = spatial::to_vector6(Twist{glm::cross(said.p_WC_W, glm::dvec3(0, 0, -1)), {0, 0, -1}});
  const FeltContact felt = felt_contact(said, {});
  const double angle = 0.4;
  const auto sample = felt.sample({spatial::rotation_from_vector({0, angle, 0}), {0, 0, 0}});
  EXPECT_NEAR(sample.depth_m, 0.1 * std::sin(angle), 1e-14);  // the point went down exactly so far
}

}  // namespace
}  // namespace farfeel::local_model
