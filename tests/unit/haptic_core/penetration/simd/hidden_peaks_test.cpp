// A narrow peak that rises above a wide one, which alone decides how far apart the nodes of a sum are: it may lie
// between them, and a search that has never seen it has to notice that it may.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "haptic_core/penetration/simd/simd.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::penetration {
namespace {

using support::flat_plate;
using support::textured_plate;

#ifdef FARFEEL_SANITIZED
constexpr int kTrials = 6;
#else
constexpr int kTrials = 40;
#endif
constexpr ReferenceOptions kIntegral{.steps_per_width = 2, .tail_widths = 20, .most_nodes = 2'000'000};
constexpr double kMound_m = 0.1e-3;

/// 1 at the middle, level there and where it ends.
double tooth(double r_m, double radius_m) {
  return r_m < radius_m ? std::pow(std::cos(0.5 * M_PI * r_m / radius_m), 2) : 0;
}

double error_of_first_answer_m(Plates& plates) {
  Query query = plates.query();
  query.wants_hessian = false;
  const Penetration fast = evaluate(*make_simd({.coarse_triangles = 16}), query);
  query.samples = 200;
  const Penetration exact = evaluate(*make_reference({.coarse_triangles = 16}, kIntegral), query);
  EXPECT_TRUE(fast.is_known());
  return std::abs(fast.depth_m - exact.depth_m);
}

TEST(HiddenPeaks, AToothOnAMoundIsFoundByTheFirstSearch) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  struct Radius {
    double m, most_m;  // off the integral; of three texels' radius, slopes are up to 4 and few nodes tell
  };
  for (const auto& [radius_m, most_m] : {Radius{0.15e-3, 7e-6}, Radius{0.2e-3, 3.5e-6}, Radius{0.3e-3, 1e-6}}) {
    double worst_m = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const double wide_m = (0.7 + 2 * unit(random)) * 1e-3, above_m = 0.4e-3 * unit(random);
      const glm::dvec2 at = 3e-3 * (glm::dvec2{unit(random), unit(random)} - 0.5);
      const auto mound_m = [&](const glm::dvec2& p) {
        return kMound_m * std::exp(-0.5 * glm::dot(p, p) / (wide_m * wide_m));
      };
      Plates plates(textured_plate({.width_m = 0.008, .depth_m = 0.008},
                                   [&](double x, double y) {
                                     const glm::dvec2 p{x, y};
                                     return mound_m(p) +
                                            (kMound_m + above_m - mound_m(at)) * tooth(glm::distance(p, at), radius_m);
                                   }),
                    flat_plate({.width_m = 0.007, .depth_m = 0.007}));
      plates.X_CT.p = 1e-4 * glm::dvec3{unit(random), unit(random), 0};
      worst_m = std::max(worst_m, error_of_first_answer_m(plates));
    }
    std::printf("tooth of radius %.2f mm: depth off by %.2f um at most\n", 1e3 * radius_m, 1e6 * worst_m);
    EXPECT_LT(worst_m, most_m);
  }
}

}  // namespace
}  // namespace farfeel::penetration
