// Where a patch's edges end a ridge, they push along it as far as they fade what weighs there: opposite ends make up
// for each other, so a sum that does not resolve the fade is noise along the ridge, as the nodes pass by.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "haptic_core/penetration/simd/simd.h"
#include "tests/unit/haptic_core/penetration/scene.h"

namespace farfeel::penetration {
namespace {

#ifdef FARFEEL_SANITIZED
constexpr int kPlaces = 10;
#else
constexpr int kPlaces = 120;
#endif

/// The longer the ridge, the less of it fades, and the fewer nodes its edges are worth.
TEST(Edges, MakeNoNoiseAlongARidge) {
  struct Width {
    double m, most_rms;
  };
  for (const auto& [soft_width_m, most_rms] : {Width{10e-6, 1.5e-3}, Width{40e-6, 6e-3}}) {
    for (const double long_m : {0.003, 0.0045, 0.005, 0.0055, 0.007, 0.012}) {
      Plates plates(waves({}, 1.5e-3, 0.1e-3, 0), waves({.width_m = 0.006, .depth_m = long_m}, 12e-3, 0.3e-3, 0));
      plates.window = {{-0.01, -0.01}, {0.01, 0.01}};
      const std::unique_ptr<BackEnd> simd = make_simd({.coarse_triangles = 8});
      double squares = 0;
      for (int k = 0; k < kPlaces; ++k) {
        plates.X_CT.p = {0.31e-3 + 2e-6 * k, 7e-6 * k, -0.2e-3};
        Query query = plates.query(soft_width_m);
        query.wants_hessian = false;
        const double along = evaluate(*simd, query).gradient[4];  // the integral has none: ridges go on past both ends
        squares += along * along;
      }
      const double rms = std::sqrt(squares / kPlaces);
      std::printf("width %.0f um, ridge of %.1f mm: slope along it %.1e rms\n", 1e6 * soft_width_m, 1e3 * long_m, rms);
      EXPECT_LT(rms, most_rms) << long_m;
    }
  }
}

}  // namespace
}  // namespace farfeel::penetration
