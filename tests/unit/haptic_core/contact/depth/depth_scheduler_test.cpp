#include "haptic_core/contact/depth/depth_scheduler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "haptic_core/penetration/reference/reference.h"
#include "haptic_core/penetration/simd/simd.h"
#include "haptic_core/penetration/window.h"
#include "tests/support/plates.h"

namespace farfeel::contact {
namespace {

using penetration::Penetration;
using penetration::Query;

geometry::HapticSurface bumps(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double period_m = 0.7e-3 + 2e-3 * uniform(random), height_m = 0.5e-3 * uniform(random),
               offset_m = 0.3e-3 * (uniform(random) - 0.5);
  return support::textured_plate({}, [=](double x, double y) {
    return offset_m + height_m * std::sin(2 * M_PI * x / period_m) * std::cos(2 * M_PI * y / period_m);
  });
}

struct Plates {
  explicit Plates(std::mt19937_64& random) : s_surface(bumps(random)), t_surface(bumps(random)) {}
  geometry::HapticSurface s_surface, t_surface;
  penetration::FeltSurface s{s_surface}, t{t_surface};
};

Penetration found(penetration::BackEnd& back_end, const Query& query) {
  Penetration answer;
  back_end.evaluate({&query, 1}, {&answer, 1});
  return answer;
}

TEST(DepthScheduler, NoBackEndFindsMoreThanTheBound) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int closely = 0, far = 0;
  for (int i = 0; i < 15; ++i) {
    std::mt19937_64 seed(static_cast<std::uint64_t>(i));
    Plates plates(seed);
    DepthScheduler bounded(plates.t, {});
    const auto fast = penetration::make_simd({}), slow = penetration::make_reference({});
    const std::vector<std::uint32_t> all{0, 1};
    for (int k = 0; k < 10; ++k) {
      // Up to 50 degrees from squarely on either, and layers deeper than the deepest among what overlaps.
      const glm::dquat tilt =
          spatial::rotation_from_vector({0.8 * uniform(random), 0.8 * uniform(random), 3 * uniform(random)});
      const glm::dquat R_CS = spatial::rotation_from_vector({0.4 * uniform(random), 0.4 * uniform(random), 0});
      const spatial::Pose X_CT{tilt * glm::dquat{0, 1, 0, 0},
                               {3e-3 * uniform(random), 3e-3 * uniform(random), 8e-3 * uniform(random)}};
      Query query{.s = {&plates.s, {R_CS, {}}, all},
                  .t = {&plates.t, X_CT, all},
                  .contact = 1,
                  .window = penetration::kWholePlane,
                  .soft_width_m = k % 2 == 0 ? 10e-6 : 200e-6,
                  .deepest_m = -4e-3 + 4e-3 * uniform(random)};
      const double most_m = bounded.most_depth_m(query);
      const Penetration by_simd = found(*fast, query);
      if (by_simd.is_known()) {
        EXPECT_LE(by_simd.depth_m, most_m) << i << ' ' << k;
      }
      query.window = {{-0.02, -0.02}, {0.02, 0.02}};
      query.samples = 100;
      const Penetration by_reference = found(*slow, query);
      if (by_reference.is_known()) {
        EXPECT_LE(by_reference.depth_m, most_m) << i << ' ' << k;
      }
      closely += by_simd.is_known() && by_simd.depth_m > most_m - 1.5e-3;
      bounded.begin_answer();
      bounded.add(0, query);
      if (bounded.by_urgency()[0].urgency >= 1) continue;
      ++far;
      EXPECT_LT(most_m, 0);
      if (by_simd.is_known()) {
        EXPECT_LT(by_simd.depth_m, 0);
      }
    }
  }
  EXPECT_GT(closely, 15);
  EXPECT_GT(far, 40);
}

/// Three contacts, too far to push, that slide past: in each answer at most one is searched, and each in its turn.
TEST(DepthScheduler, WhatIsTooFarToPushIsSearchedInTurn) {
  std::mt19937_64 random(5);
  Plates plates(random);
  DepthScheduler scheduler(plates.t, {});
  const std::vector<std::uint32_t> all{0, 1};
  const auto back_end = penetration::make_simd({});
  const auto query_at = [&](std::uint32_t contact, double apart_m, double aside_m) {
    return Query{.s = {&plates.s, {}, all},
                 .t = {&plates.t, {{0, 1, 0, 0}, {aside_m, 0, apart_m}}, all},
                 .contact = contact,
                 .window = penetration::kWholePlane,
                 .deepest_m = -apart_m + 0.5e-3};
  };
  std::array<int, 3> searches{};
  for (int answer = 0; answer < 60; ++answer) {
    scheduler.begin_answer();
    for (std::uint32_t c = 0; c < 3; ++c) scheduler.add(c, query_at(c + 1, 4e-3 + 1e-3 * c, 20e-6 * answer));
    std::size_t searched = 0;
    for (DepthJob& job : scheduler.by_urgency()) {
      EXPECT_LT(job.urgency, 1);
      if (scheduler.takes(job, searched, 0)) {
        ++searched, ++searches[job.i];
        scheduler.keep(job.query, found(*back_end, job.query), {});
      } else if (answer > 3) {
        const Penetration depth = scheduler.extrapolated(job);
        EXPECT_TRUE(depth.is_known());
        EXPECT_LT(depth.depth_m, 0);
      }
    }
    EXPECT_LE(searched, 1u);
  }
  for (const int of_one : searches) {
    EXPECT_GE(of_one, 1);
    EXPECT_LE(of_one, 8);
  }
  scheduler.begin_answer();
  scheduler.add(0, query_at(1, 0.5e-3, 0));
  EXPECT_GE(scheduler.by_urgency()[0].urgency, 1) << "it may touch";
}

/// Contacts that may push, on a budget of two searches an answer.
class OnABudget : public ::testing::Test {
 protected:
  [[nodiscard]] Query at(std::uint32_t contact, double x_m) const {
    return {
        .s = {&plate_, {}, all_}, .t = {&plate_, {{0, 1, 0, 0}, {x_m, 0, 0}}, all_}, .contact = contact, .window = {}};
  }
  double urgency(const Query& query) {
    scheduler_.begin_answer();
    scheduler_.add(0, query);
    return scheduler_.by_urgency()[0].urgency;
  }
  geometry::HapticSurface surface_ = support::flat_plate({});
  penetration::FeltSurface plate_{surface_};
  std::vector<std::uint32_t> all_{0, 1};
  DepthScheduler scheduler_{plate_, {.most_searches = 2}};
  Penetration found_{.p_CQ_C = glm::dvec3{0}, .depth_m = 1e-4, .gradient = spatial::Vector6::Unit(5), .doubts = 0};
};

TEST_F(OnABudget, AContactThatStandsIsSearchedAgainAfterEightAnswers) {
  scheduler_.keep(at(1, 0), found_, {});
  int extrapolated = 0;
  for (; urgency(at(1, 0)) < 1 && extrapolated < 100; ++extrapolated)
    EXPECT_TRUE(scheduler_.extrapolated({.i = 0, .query = at(1, 0), .most_depth_m = 1}).is_known());
  EXPECT_EQ(extrapolated, 8);
}

TEST_F(OnABudget, AContactThatSlidesIsSearchedAgainBeforeItHasGoneAFractionOfARidge) {
  scheduler_.keep(at(1, 0), found_, {});
  EXPECT_LT(urgency(at(1, 0.1e-3)), 1);
  EXPECT_GE(urgency(at(1, 0.15e-3)), 1);
}

TEST_F(OnABudget, WhatIsNewNamelessCurvedOrBetweenOtherSurfacesHasToBeSearched) {
  scheduler_.keep(at(2, 0), found_, {});
  EXPECT_LT(urgency(at(2, 0)), 1);
  EXPECT_GE(urgency(at(1, 0)), 1) << "new";
  EXPECT_GE(urgency(at(2 + TrackNames::kSlots, 0)), 1) << "it has taken the other's slot";
  EXPECT_GE(urgency(at(0, 0)), 1) << "nameless";
  Query curved = at(2, 0);
  curved.wants_hessian = true;
  EXPECT_GE(urgency(curved), 1) << "a search is what finds curvature";
  const penetration::FeltSurface other(surface_);
  Query elsewhere = at(2, 0);
  elsewhere.s.surface = &other;
  EXPECT_GE(urgency(elsewhere), 1) << "another surface";
  scheduler_.keep(at(2, 0), {}, {});
  EXPECT_GE(urgency(at(2, 0)), 1) << "what is not known is not kept";
}

TEST_F(OnABudget, TwoAreSearchedTheMostUrgentFirstAndNoMoreOnceOneWasCostly) {
  for (std::uint32_t c = 1; c <= 4; ++c) scheduler_.keep(at(c, 0), found_, {.lacks = c == 2, .off_m = 1e-6 * c});
  const auto searched_of = [&](std::uint64_t costly) {
    scheduler_.begin_answer();
    for (std::uint32_t c = 1; c <= 4; ++c) scheduler_.add(c, at(c, 20e-6 * c));
    std::vector<std::size_t> which;
    for (const DepthJob& job : scheduler_.by_urgency())
      if (scheduler_.takes(job, which.size(), which.empty() ? 0 : costly)) which.push_back(job.i);
    return which;
  };
  EXPECT_EQ(searched_of(0), (std::vector<std::size_t>{4, 3}));
  EXPECT_EQ(searched_of(1), (std::vector<std::size_t>{4}));
  EXPECT_TRUE(scheduler_.lack(2).lacks);
  EXPECT_EQ(scheduler_.lack(2).off_m, 2e-6);
  EXPECT_FALSE(scheduler_.lack(9).lacks);
}

}  // namespace
}  // namespace farfeel::contact
