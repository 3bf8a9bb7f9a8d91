// What a search left out may come into reach while its cells are summed again: a ridge moves in from aside, a layer
// that lies higher, an edge that meets an edge. At every step the answer is held against a search from nothing.
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
constexpr int kPaths = 1;
#else
constexpr int kPaths = 3;
#endif

/// 0 to 1 over a slope that is 1 / `wide` on the mean and rounded at both ends.
double step(double x, double wide) {
  const double s = std::clamp(x / wide, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

constexpr double kFelt_m = 0.25e-3, kSliver_m = 0.1e-3, kHalfTool_m = 1.5e-3;

struct Worst {
  double depth_m = 0, force_share = 0;
  int steps = 0, compared = 0;  ///< what is not compared is counted: where most of the steps are not, nothing is proven
};

/// T slides along `way` from a place that both are at home at, `steps` times.
Worst worst_along(Plates& plates, const glm::dvec3& from, const glm::dvec3& way, const glm::dvec3& turn_rad, int steps,
                  double soft_width_m, double ledge_x_m) {
  const auto remembers = make_simd({.coarse_triangles = 16}), forgets = make_simd({.coarse_triangles = 16});
  plates.X_CS = {};
  plates.X_CT = {kTurnedOver, from};
  const glm::dquat turn = spatial::rotation_from_vector(turn_rad);
  Worst worst;
  for (int k = 0; k < steps; ++k) {
    plates.X_CT = {glm::normalize(turn * plates.X_CT.R), plates.X_CT.p + way};
    Query query = plates.query(soft_width_m);
    query.wants_hessian = false;
    query.t.triangles = query.t.triangles.first(2);
    const Penetration kept = evaluate(*remembers, query);
    query.contact = static_cast<std::uint32_t>(k) + 1;  // another one every time
    const Penetration fresh = evaluate(*forgets, query);
    // Far apart a search takes coarser steps, and where too much touches; both are off by what those are.
    ++worst.steps;
    if ((kept.doubts | fresh.doubts) & (kNoOverlap | kCoarseSteps | kBorder) || fresh.depth_m < -kFelt_m) continue;
    // So little of an edge over an edge is resolved by chance: any two searches differ.
    const double over_m = plates.X_CT.p.x + kHalfTool_m - ledge_x_m;
    if (over_m > -kSliver_m / 10 && over_m < kSliver_m) continue;
    ++worst.compared;
    const double error_m = std::abs(kept.depth_m - fresh.depth_m);
    // Of springs that are pressed 0.2 mm deep more than they reach.
    constexpr double kPressed_m = 0.2e-3;
    const spatial::Vector6 force = (kPressed_m + fresh.depth_m - from.z) * fresh.gradient,
                           felt = (kPressed_m + kept.depth_m - from.z) * kept.gradient;
    const double share = (felt - force).tail<3>().norm() / std::max(force.tail<3>().norm(), kPressed_m);
    worst.depth_m = std::max(worst.depth_m, error_m);
    worst.force_share = std::max(worst.force_share, share);
  }
  return worst;
}

struct Case {
  const char* name;
  geometry::HapticSurface s, t;
  double most_m;  ///< that two searches differ by
  glm::dvec3 from{0, 0, 0};
  bool turns = false;
  double ledge_x_m = 1;  ///< where T's edge comes to an edge of S's
  std::vector<std::uint32_t> s_triangles{0, 1};
};

/// A gentle mound at x_m that touches where T is flat, 0.1 mm above the ground.
double mound(double x, double y, double x_m) {
  constexpr double kHeight_m = 0.1e-3, kWide_m = 0.5e-3;
  return kHeight_m * (std::exp(-0.5 * ((x - x_m) * (x - x_m) + y * y) / (kWide_m * kWide_m)) - 1);
}
double dome(double x, double y) {
  return mound(x, y, -1.5e-3);
}

std::vector<Case> cases() {
  std::vector<Case> all;
  // A step that rises twice as steep as anything that touches; T's tooth, clear of the ground, slides against it.
  const auto with_step = [](double x, double y) { return dome(x, y) + 0.5e-3 * step(x - 1.5e-3, 0.5e-3); };
  const auto with_tooth = [](double x, double y) {
    const double r = std::hypot(x - 0.9e-3, y);
    return r < 0.4e-3 ? 0.05e-3 * std::pow(std::cos(0.5 * M_PI * r / 0.4e-3), 2) : 0;
  };
  all.push_back({"tooth at a step",
                 textured_plate({.width_m = 0.007, .depth_m = 0.007}, with_step),
                 textured_plate({.width_m = 0.005, .depth_m = 0.005}, with_tooth),
                 2e-6,
                 {}});
  // T is flat, and its edge comes against the step.
  all.push_back({"edge at a step",
                 textured_plate({.width_m = 0.007, .depth_m = 0.007}, with_step),
                 flat_plate({.width_m = 0.0026, .depth_m = 0.003}),
                 5e-6,
                 {}});
  // Steep ridges over a far longer wave: the wave's crest alone has touched so far.
  all.push_back({"ridges on a wave",
                 textured_plate({.width_m = 0.007, .depth_m = 0.007},
                                [](double x, double y) {
                                  return dome(x, y) + (x > 0 ? 0.15e-3 * std::cos(16e3 * x) * step(x, 1e-3) : 0);
                                }),
                 textured_plate({.width_m = 0.006, .depth_m = 0.005},
                                [](double x, double y) {
                                  return 0.12e-3 * std::cos(14e3 * (x + 0.2 * y)) *
                                         step(std::abs(x + 1.5e-3) - 1e-3, 1e-3);
                                }),
                 1e-6,
                 {},
                 true});
  // A second layer above the first, which T's edge slides under: with T's edge it meets an edge.
  all.push_back({"a shelf",
                 support::stacked(textured_plate({.width_m = 0.008, .depth_m = 0.008}, dome),
                                  flat_plate({.width_m = 0.002, .depth_m = 0.004}), {0.0030, 0, 0.2e-3}),
                 flat_plate({.width_m = 0.003, .depth_m = 0.003}),
                 8e-6,
                 {},
                 false,
                 2.0e-3,
                 {0, 1, 2, 3}});
  // T's edge leaves the first layer's ground, and comes to the second's edge across a gap.
  all.push_back({"across a gap",
                 support::stacked(textured_plate({.width_m = 0.003, .depth_m = 0.004},
                                                 [](double x, double y) { return mound(x, y, 0); }),
                                  flat_plate({.width_m = 0.002, .depth_m = 0.004}), {0.0031, 0, 0.1e-3}),
                 flat_plate({.width_m = 0.003, .depth_m = 0.003}),
                 18e-6,
                 {},
                 false,
                 2.1e-3,
                 {0, 1, 2, 3}});
  return all;
}

TEST(KeptCells, NothingComesIntoReachUnseen) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (Case& c : cases()) {
    Plates plates(std::move(c.s), std::move(c.t));
    plates.all = c.s_triangles;
    Worst of_case;
    for (const double soft_width_m : {10e-6, 0.0}) {
      for (const double step_m : {0.5e-6, 3e-6, 15e-6, 60e-6}) {
        Worst worst;
        for (int path = 0; path < kPaths; ++path) {
          const glm::dvec3 from = c.from + 1e-4 * glm::dvec3{unit(random), unit(random), 0};
          const glm::dvec3 way = step_m * glm::normalize(glm::dvec3{1, 0.3 * unit(random), 0});
          const glm::dvec3 turn = c.turns ? step_m / 0.003 * 0.3 * glm::dvec3{0, 0, unit(random)} : glm::dvec3{0};
          const int steps = std::min(300, static_cast<int>(1.2e-3 / step_m));
          // Slow ones begin near where it happens.
          const double skip_m = step_m < 2e-6 ? 0.35e-3 + 0.3e-3 * (unit(random) + 1) : 0;
          const Worst one =
              worst_along(plates, from + skip_m / step_m * way, way, turn, steps, soft_width_m, c.ledge_x_m);
          worst.depth_m = std::max(worst.depth_m, one.depth_m);
          worst.force_share = std::max(worst.force_share, one.force_share);
          worst.steps += one.steps, worst.compared += one.compared;
        }
        std::printf(
            "%-16s width %2.0f um, %4.1f um a step: depth off by %6.2f um, force by %6.2f %%, %d of %d compared\n",
            c.name, 1e6 * soft_width_m, 1e6 * step_m, 1e6 * worst.depth_m, 100 * worst.force_share, worst.compared,
            worst.steps);
        of_case.steps += worst.steps, of_case.compared += worst.compared;
        EXPECT_LT(worst.depth_m, soft_width_m > 0 ? c.most_m : 1e-6) << c.name;
      }
    }
    EXPECT_GT(2 * of_case.compared, of_case.steps) << c.name;
  }
}

}  // namespace
}  // namespace farfeel::penetration
