// With a frozen contact frame and no friction the wrench is the gradient of the energy: closed paths make none.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "haptic_core/contact/depth/contact_frame.h"
#include "haptic_core/contact/penalty.h"
#include "haptic_core/penetration/reference/reference.h"
#include "haptic_core/penetration/simd/simd.h"
#include "tests/support/plates.h"

namespace farfeel::contact {
namespace {

using penetration::BackEnd;
using penetration::FeltSurface;
using spatial::Pose;
using spatial::Vector6;

double ridges_m(double period_m, double x_m) {
  return 0.1e-3 * std::cos(2 * std::numbers::pi * x_m / period_m);
}

struct Frozen {
  geometry::HapticSurface s_surface = support::textured_plate(
                              {}, [](double x, double y) { return ridges_m(3e-3, x + 0.3 * y); }),
                          t_surface = support::textured_plate(
                              {}, [](double x, double y) { return ridges_m(2.2e-3, x - 0.1 * y); });
  FeltSurface s{s_surface}, t{t_surface};
  std::vector<std::uint32_t> all{0, 1};
  Cluster cluster;

  Frozen() { cluster.nhat_ST_S = {0, 0, 1}; }
  Frozen(const Frozen&) = delete;
  Frozen& operator=(const Frozen&) = delete;

  [[nodiscard]] Contact at(BackEnd& back_end, const Pose& X_ST) const {
    const Pose X_CS = spatial::inverse(contact_frame(cluster));
    const penetration::Query query{
        .s = {&s, X_CS, all}, .t = {&t, X_CS * X_ST, all}, .window = {{-4e-3, -4e-3}, {4e-3, 4e-3}}};
    penetration::Penetration depth;
    back_end.evaluate({&query, 1}, {&depth, 1});
    return contact_from(cluster, depth, {}, X_ST.p);
  }
  /// A closed path in all six degrees of freedom, once round as phase goes from 0 to 1.
  [[nodiscard]] static Pose along(double phase) {
    const double a = 2 * std::numbers::pi * phase;
    return {spatial::rotation_from_vector({2e-3 * std::sin(a), 2e-3 * std::cos(2 * a), 5e-3 * std::sin(a)}) *
                glm::dquat{0, 1, 0, 0},
            {0.4e-3 * std::cos(a), 0.2e-3 * std::sin(2 * a), -0.05e-3 + 0.03e-3 * std::sin(a)}};
  }
};

Vector6 change(const Pose& from, const Pose& to) {
  return spatial::to_vector6(
      spatial::Twist{spatial::vector_from_rotation(to.R * glm::conjugate(from.R)), to.p - from.p});
}

/// Work of the contact on T round the closed path, by the wrench at each step's middle [J].
double work_J(const Frozen& frozen, BackEnd& back_end, int steps) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const Pose from = Frozen::along(double(i) / steps), to = Frozen::along(double(i + 1) / steps);
    const Contact middle = frozen.at(back_end, Frozen::along((i + 0.5) / steps));
    sum += spatial::to_vector6(penalty_wrench(middle, {})).dot(change(from, to));
  }
  return sum;
}

double greatest_J(const Frozen& frozen, BackEnd& back_end) {
  double most = 0;
  for (int i = 0; i < 40; ++i) most = std::max(most, penalty_energy_J(frozen.at(back_end, Frozen::along(i / 40.0))));
  return most;
}

TEST(Consistency, TheReferencesWrenchIsTheEnergysGradient) {
  const Frozen frozen;
  const auto back_end =
      penetration::make_reference({}, {.steps_per_width = 3, .tail_widths = 30, .most_nodes = 400'000});
  const Pose X_ST = Frozen::along(0.13);
  const Vector6 F = spatial::to_vector6(penalty_wrench(frozen.at(*back_end, X_ST), {}));
  ASSERT_GT(F.norm(), 0.01);
  for (int k = 0; k < 6; ++k) {
    const auto slope = [&](double step) {
      double energy[2];
      for (const int side : {0, 1}) {
        const Vector6 q = (side == 0 ? step : -step) * Vector6::Unit(k);
        energy[side] = penalty_energy_J(
            frozen.at(*back_end, {glm::normalize(spatial::rotation_from_vector({q[0], q[1], q[2]}) * X_ST.R),
                                  X_ST.p + glm::dvec3{q[3], q[4], q[5]}}));
      }
      return (energy[0] - energy[1]) / (2 * step);
    };
    const double step = k < 3 ? 2e-5 : 2e-7;  // Richardson's extrapolation of central differences
    const double numeric = (4 * slope(0.5 * step) - slope(step)) / 3, arm = k < 3 ? 0.01 : 1;
    EXPECT_NEAR(-numeric, F[k], 1e-6 * F.tail<3>().norm() * arm) << k;
  }
}

TEST(Consistency, ClosedPathsMakeNoEnergy) {
  const Frozen frozen;
  const auto reference = penetration::make_reference({}), simd = penetration::make_simd({});
  const double stored_J = greatest_J(frozen, *simd);
  ASSERT_GT(stored_J, 1e-6);
  EXPECT_LT(std::abs(work_J(frozen, *simd, 600)), 1e-3 * stored_J);
  EXPECT_LT(std::abs(work_J(frozen, *reference, 150)),
            4e-3 * stored_J);  // the midpoint rule's own error at so few steps
}

TEST(Consistency, TheSimdWrenchIsTheReferencesWithinAThousandth) {
  const Frozen frozen;
  const auto reference = penetration::make_reference({}), simd = penetration::make_simd({});
  for (int i = 0; i < 25; ++i) {
    const Pose X_ST = Frozen::along(i / 25.0);
    const Vector6 slow = spatial::to_vector6(penalty_wrench(frozen.at(*reference, X_ST), {}));
    const Vector6 fast = spatial::to_vector6(penalty_wrench(frozen.at(*simd, X_ST), {}));
    EXPECT_LT((fast - slow).tail<3>().norm(), 2e-3 * slow.tail<3>().norm()) << i;
  }
}

}  // namespace
}  // namespace farfeel::contact
