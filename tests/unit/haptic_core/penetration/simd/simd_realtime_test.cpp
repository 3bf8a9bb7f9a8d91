#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "haptic_core/penetration/simd/simd.h"
#include "tests/support/realtime_guard.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::penetration {
namespace {

TEST(Simd, AnswersWithoutAllocatingLockingOrThrowing) {
  if (!test_support::RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need malloc for themselves";
  const auto waves = [](double x, double y) { return 1e-4 * std::cos(3e3 * x + 1e3 * y); };
  Plates plates(support::textured_plate({}, waves), support::textured_plate({.width_m = 0.005}, waves));
  const auto simd = make_simd({.coarse_triangles = 8});
  std::array<Query, 7> queries;
  std::array<Penetration, 7> answers;
  for (int frame = 0; frame < 20; ++frame) {
    for (std::size_t i = 0; i < queries.size(); ++i) {
      plates.X_CT.p = {1e-3 * std::sin(frame + 2.0 * static_cast<double>(i)), 1e-4 * frame, 1e-4 * (frame % 5)};
      queries[i] = plates.query(i == 3 ? 0 : 1e-5, i == 4 ? kMaxSamples : 50);
      if (i == 5) queries[i].window = {{0.1, 0.1}, {0.2, 0.2}};  // nothing there
      queries[i].wants_hessian = i % 2 == 1;
    }
    const test_support::RealtimeGuard guard;
    simd->evaluate(queries, answers);
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), 0u) << test_support::RealtimeGuard::first_violation();
  EXPECT_FALSE(answers[5].is_known());
  EXPECT_TRUE(answers[0].is_known());
}

}  // namespace
}  // namespace farfeel::penetration
