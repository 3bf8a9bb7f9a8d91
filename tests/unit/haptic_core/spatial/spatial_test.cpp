#include "haptic_core/spatial/spatial.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>

#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::spatial {
namespace {

class SpatialTest : public ::testing::Test {
 protected:
  glm::dvec3 vector(double size = 1) {
    return size * glm::dvec3(uniform_(random_), uniform_(random_), uniform_(random_));
  }
  Pose pose() { return {rotation_from_vector(vector(2)), vector()}; }

 private:
  std::mt19937 random_{7};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance = 1e-14) {
  EXPECT_LE(glm::length(a - b), tolerance);
}

TEST_F(SpatialTest, ComposesAndInverts) {
  for (int i = 0; i < 100; ++i) {
    const Pose X_AB = pose(), X_BC = pose();
    const glm::dvec3 p_C = vector();
    expect_near(transform_point(X_AB * X_BC, p_C), transform_point(X_AB, transform_point(X_BC, p_C)));
    expect_near(transform_point(inverse(X_AB) * X_AB, p_C), p_C);
    expect_near(rotate_back(X_AB, rotate(X_AB, p_C)), p_C);
  }
}

TEST_F(SpatialTest, RotationVectorsRoundTripFromTinyToHalfATurn) {
  for (double angle : {0.0, 1e-300, 1e-12, 1e-8, 1e-5, 1e-4, 1e-2, 0.0199, 0.0201, 1.0, 3.0, std::numbers::pi - 1e-9}) {
    const glm::dvec3 v = angle * glm::normalize(glm::dvec3(1, -2, 3));
    expect_near(vector_from_rotation(rotation_from_vector(v)), v, 1e-15 + 1e-14 * angle);
    expect_near(vector_from_rotation(-rotation_from_vector(v)), v, 1e-15 + 1e-14 * angle);
  }
}

TEST_F(SpatialTest, FrameWithZIsARotationWhoseZIsTheNormal) {
  for (glm::dvec3 n : {glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1), glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0),
                       glm::normalize(glm::dvec3(1e-9, 0, -1)), glm::normalize(glm::dvec3(-1, 2, 3))}) {
    const glm::dquat R = frame_with_z(n);
    expect_near(R * glm::dvec3(0, 0, 1), n, 1e-12);
    EXPECT_NEAR(glm::length(R), 1, 1e-14);
  }
}

TEST_F(SpatialTest, PowerDoesNotDependOnThePointOrTheFrame) {
  for (int i = 0; i < 100; ++i) {
    const Wrench F{vector(), vector()};
    const Twist V{vector(), vector()};
    const glm::dvec3 p_PQ = vector();
    const Wrench F_Q = moved(F, -p_PQ);
    EXPECT_NEAR(power_W(F, V), power_W(F_Q, {V.angular_rad_s, velocity_at(V, p_PQ)}), 1e-13);
    EXPECT_NEAR(power_W(F, V), to_vector6(F).dot(to_vector6(V)), 1e-14);
  }
}

TEST_F(SpatialTest, IntegratesAConstantTwistAboutAFixedAxis) {
  const Twist V{{0, 0, 2}, {0.1, 0, 0}};
  Pose X;
  for (int i = 0; i < 1000; ++i) X = integrate(X, V, 1e-3);
  expect_near(vector_from_rotation(X.R), {0, 0, 2}, 1e-12);
  expect_near(X.p, {0.1, 0, 0}, 1e-12);
}

TEST_F(SpatialTest, NamesWhatIsNotFinite) {
  Pose X = pose();
  EXPECT_TRUE(is_valid(X));
  X.R.w = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_valid(X));
  EXPECT_FALSE(is_valid(Pose{{0, 0, 0, 0}, {0, 0, 0}}));
  EXPECT_FALSE(is_finite(Wrench{{0, 0, 0}, {0, std::numeric_limits<double>::infinity(), 0}}));
}

TEST_F(SpatialTest, CutsWhatIsTooLongAndNothingElse) {
  for (int i = 0; i < 100; ++i) {
    const glm::dvec3 v = vector();
    const double length = glm::length(v);
    EXPECT_EQ(no_longer_than(1.01 * length, v), v);
    expect_near(no_longer_than(0.3 * length, v), 0.3 * v);
    EXPECT_EQ(no_longer_than(0, v), glm::dvec3(0));
  }
  EXPECT_EQ(no_longer_than(0, glm::dvec3(0)), glm::dvec3(0));
}

}  // namespace
}  // namespace farfeel::spatial
