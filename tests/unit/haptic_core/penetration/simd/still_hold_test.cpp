// When the cells of an earlier search may be summed again: what they were found for must still be there.
#include <gtest/gtest.h>

#include "haptic_core/penetration/simd/kept_cells.h"
#include "tests/support/plates.h"

namespace farfeel::penetration {
namespace {

class StillHoldTest : public ::testing::Test {
 protected:
  StillHoldTest() {
    (void)cells_.store(0);
    cells_.keep(at({}), search_, 10);
  }
  /// T turned by so much about the contact point, in C.
  [[nodiscard]] Query at(const glm::dvec3& turn_rad) const {
    return {.s = {&s_, {}, all_},
            .t = {&t_, {glm::normalize(spatial::rotation_from_vector(turn_rad) * glm::dquat{0, 1, 0, 0}), {}}, all_},
            .contact = 1,
            .window = window_};
  }
  [[nodiscard]] bool hold(const Query& query) {
    KeptCells::Place place;
    return cells_.still_hold(query, place);
  }

  Window window_{{-2e-3, -2e-3}, {2e-3, 2e-3}};
  geometry::HapticSurface surface_ = support::textured_plate({}, [](double, double) { return 0.0; });
  FeltSurface s_{surface_}, t_{surface_};
  std::vector<std::uint32_t> all_{0, 1};
  KeptCells::Search search_{.p_CQ = glm::dvec3{0},
                            .searched = window_,
                            .step_m = 1e-4,
                            .best_m = 0,
                            .nearer_m = 20e-6,
                            .least_way_m = 50e-6,
                            .least_way_at_edge_m = 50e-6,
                            .is_at_edge = false,
                            .spread = {}};
  KeptCells cells_;
};

TEST_F(StillHoldTest, WhereNothingMoved) {
  EXPECT_TRUE(hold(at({})));
}

// The farthest place searched is 2.8 mm away: a tilt of 10 mrad brings it 28 um nearer, and 20 um are spare.
TEST_F(StillHoldTest, UntilATiltBringsNearerWhatWasLeftOut) {
  EXPECT_TRUE(hold(at({1e-3, 0, 0})));
  EXPECT_FALSE(hold(at({10e-3, 0, 0})));
  EXPECT_FALSE(hold(at({0, -10e-3, 0})));
}

TEST_F(StillHoldTest, UntilEitherSurfaceChanges) {
  s_.take_tile(0);
  EXPECT_FALSE(hold(at({})));
  cells_.keep(at({}), search_, 10);
  ASSERT_TRUE(hold(at({})));
  t_.take_tile(0);
  EXPECT_FALSE(hold(at({})));
}

}  // namespace
}  // namespace farfeel::penetration
