#include "haptic_core/contact/depth/extrapolation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "haptic_core/contact/depth/constants.h"
#include "haptic_core/penetration/simd/simd.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::contact {
namespace {

using namespace penetration;

constexpr Limits kLimits{.coarse_triangles = 8};

struct Slide {
  Plates plates{waves({}, 1.5e-3, 0.1e-3, 0), waves({}, 12e-3, 0.3e-3, 0.4)};
  double turn_rad = 0;

  /// Contact `contact` of several that slide alike, shifted along the ridges' pattern; a step of 25 um is 0.1 m/s at 4
  /// kHz.
  Query query(std::uint32_t contact, int step, double step_m = 25e-6) {
    plates.X_CT.R = spatial::rotation_from_vector({0.01, 0.005, turn_rad * step}) * kTurnedOver;
    plates.X_CT.p = {step_m * step + 0.2e-3 * contact, 0.1e-3, 0.05e-3};
    Query query = plates.query();
    query.contact = contact;
    query.wants_hessian = false;
    return query;
  }
};

TEST(Extrapolation, HoldsAlongAFractionOfARidgeWithinAFewMicrometres) {
  const auto each = make_simd(kLimits);
  double square = 0, worst_gradient = 0;
  int count = 0;
  for (int start = 0; start < 200; start += 5) {
    Slide slide;
    slide.turn_rad = 1e-4;
    Extrapolation from;
    const Query begun = slide.query(1, start);
    from.begin(begun, evaluate(*make_simd(kLimits), begun));
    for (int step = start + 1;; ++step) {
      const Query query = slide.query(1, step);
      if (!(from.way_m(query) < kAllowedWay_m)) break;
      const Penetration here = from.at(query), exact = evaluate(*each, query);
      EXPECT_NEAR(here.depth_m, exact.depth_m, 10e-6);
      square += std::pow(here.depth_m - exact.depth_m, 2), ++count;
      worst_gradient = std::max(worst_gradient, (here.gradient - exact.gradient).tail<3>().norm());
    }
  }
  RecordProperty("depth_rms_um", std::to_string(1e6 * std::sqrt(square / count)));
  RecordProperty("worst_gradient", std::to_string(worst_gradient));
  EXPECT_EQ(count, 40 * 4) << "0.12 mm are four steps of 25 um";
  EXPECT_LT(std::sqrt(square / count), 2e-6);
  EXPECT_LT(worst_gradient, 0.3);
}

TEST(Extrapolation, TheBackEndSaysWhichAnswersWereCostly) {
  const auto back_end = make_simd(kLimits);
  Plates plates(waves({}, 3e-3, 0.5e-3, 0.4), waves({.width_m = 0.005, .depth_m = 0.003}, 2e-3, 0.2e-3, 1));
  const auto searches = [&](double x_m) {
    plates.X_CT.p.x = x_m;
    const std::uint64_t before = back_end->searches();
    Query query = plates.query();
    query.wants_hessian = false;
    (void)evaluate(*back_end, query);
    return back_end->searches() - before;
  };
  EXPECT_EQ(searches(0), 1u);
  (void)searches(0);  // may settle on another step
  EXPECT_EQ(searches(0), 0u) << "nothing has moved";
  EXPECT_EQ(searches(1e-3), 1u);
}

}  // namespace
}  // namespace farfeel::contact
