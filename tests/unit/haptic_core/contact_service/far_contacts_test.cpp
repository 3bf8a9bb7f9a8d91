#include "haptic_core/contact_service/far_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "haptic_core/penetration/reference.h"
#include "haptic_core/penetration/simd.h"
#include "haptic_core/penetration/window.h"
#include "tests/support/plates.h"

namespace farfeel::contact_service {
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

TEST(FarContacts, NoBackEndFindsMoreThanTheBound) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int closely = 0, far = 0;
  for (int i = 0; i < 15; ++i) {
    std::mt19937_64 seed(static_cast<std::uint64_t>(i));
    Plates plates(seed);
    FarContacts bounded(plates.t);
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
      Penetration carried;
      bounded.begin();
      if (!bounded.takes(query, 0, carried)) continue;
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

TEST(FarContacts, AreSearchedInTurnAndCarriedBetween) {
  std::mt19937_64 random(5);
  Plates plates(random);
  FarContacts far(plates.t);
  const std::vector<std::uint32_t> all{0, 1};
  const auto back_end = penetration::make_simd({});
  const auto query_at = [&](std::uint32_t contact, double apart_m, double aside_m) {
    return Query{.s = {&plates.s, {}, all},
                 .t = {&plates.t, {{0, 1, 0, 0}, {aside_m, 0, apart_m}}, all},
                 .contact = contact,
                 .window = penetration::kWholePlane,
                 .deepest_m = -apart_m + 0.5e-3};
  };
  int searches = 0;
  for (int i = 0; i < 60; ++i) {
    far.begin();
    std::array<Penetration, 3> depths;
    for (std::uint32_t c = 0; c < 3; ++c) {
      ASSERT_TRUE(far.takes(query_at(c + 1, 4e-3 + 1e-3 * c, 20e-6 * i), c, depths[c]));
      if (i > 3) {
        EXPECT_TRUE(depths[c].is_known());
        EXPECT_LT(depths[c].depth_m, 0);
      }
    }
    if (const FarContacts::Turn* turn = far.turn()) {
      ++searches;
      far.keep(found(*back_end, turn->query));
    }
  }
  EXPECT_GE(searches, 3 + 2);
  EXPECT_LE(searches, 15);
  Penetration depth;
  EXPECT_FALSE(far.takes(query_at(1, 0.5e-3, 0), 0, depth)) << "it may touch";
}

}  // namespace
}  // namespace farfeel::contact_service
