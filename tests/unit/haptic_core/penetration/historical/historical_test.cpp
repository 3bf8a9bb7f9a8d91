// The source's algorithm against the same grid in double precision: what is left is 16-bit depth and one look-up.
#include "haptic_core/penetration/historical/historical.h"

#include <gtest/gtest.h>

#include <random>

#include "haptic_core/penetration/reference/eleven_evaluations.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::penetration::historical {
namespace {

constexpr Limits kLimits{.coarse_triangles = 64};

class Historical : public testing::Test {
 protected:
  void SetUp() override {
    auto made = make_historical(kLimits);
    if (!made) GTEST_SKIP() << made.error().message;
    historical_ = *std::move(made);
  }
  void compare(Plates& plates, double tilt_rad, double depth_m, double gradient) {
    historical_->prepare(plates.s);
    historical_->prepare(plates.t);
    const auto reference = make_reference(kLimits);
    std::mt19937 random(21);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int trial = 0; trial < 6; ++trial) {
      const double u = tilt_rad * unit(random), v = tilt_rad * unit(random), turn = 3 * unit(random);
      plates.X_CT.R = spatial::rotation_from_vector({u, v, turn}) * kTurnedOver;
      plates.X_CT.p = 1e-3 * glm::dvec3{unit(random), unit(random), 0.3 * unit(random)};
      Query query = plates.query(0, trial % 2 ? 50 : 37);
      query.wants_hessian = false;
      query.refines = false;
      const Penetration drawn = evaluate(*historical_, query), exact = eleven_evaluations(*reference, query, {});
      ASSERT_TRUE(drawn.is_known());
      EXPECT_NEAR(drawn.depth_m, exact.depth_m, depth_m) << trial;
      EXPECT_LT((drawn.gradient - exact.gradient).tail<3>().norm(), gradient) << trial;
      EXPECT_LT(glm::distance(drawn.p_CQ_C, exact.p_CQ_C), 1e-3) << trial;
    }
  }
  std::unique_ptr<BackEnd> historical_;
};

/// Plates that face each other straight: no parallax, so only the depth buffer's 65,534 steps and the pixels differ.
TEST_F(Historical, StraightOnItIsTheGrid) {
  Plates plates(waves({}, 3e-3, 0.3e-3, 0), waves({.width_m = 0.006, .depth_m = 0.006}, 4.2e-3, 0.2e-3, 0.9));
  compare(plates, 0, 60e-9, 0.02);
}

/// A tool that leans looks its texture up a little aside: an error that the source's method has, and bounded.
TEST_F(Historical, LeaningItErrsByItsOneLookUp) {
  Plates plates(waves({}, 3e-3, 0.2e-3, 0), waves({.width_m = 0.006, .depth_m = 0.006}, 4.2e-3, 0.2e-3, 0.9));
  compare(plates, 0.05, 4e-6, 0.3);
}

TEST_F(Historical, NothingSharedIsNothingKnown) {
  Plates plates(waves({}, 3e-3, 0.2e-3, 0), waves({}, 4.2e-3, 0.2e-3, 0.9));
  historical_->prepare(plates.s);
  historical_->prepare(plates.t);
  Query query = plates.query();
  query.window = {{0.1, 0.1}, {0.2, 0.2}};
  EXPECT_FALSE(evaluate(*historical_, query).is_known());
}

/// Without its surfaces on the device the same method goes on in double precision.
TEST_F(Historical, UnknownSurfacesAreTheReferences) {
  Plates plates(waves({}, 3e-3, 0.2e-3, 0), waves({}, 4.2e-3, 0.2e-3, 0.9));
  Query raw = plates.query(0);
  raw.refines = raw.wants_hessian = false;
  EXPECT_EQ(evaluate(*historical_, plates.query()).depth_m,
            eleven_evaluations(*make_reference(kLimits), raw, {}).depth_m);
}

}  // namespace
}  // namespace farfeel::penetration::historical
