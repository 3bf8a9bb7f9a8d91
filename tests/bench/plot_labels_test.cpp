#include "tests/bench/plot_labels.h"

#include <gtest/gtest.h>

namespace farfeel::bench {
namespace {

TEST(PlotLabels, StandWhereTheyBelongUnlessAnotherOneDoes) {
  const std::array<double, 4> apart{340, 10, 200, 100};
  EXPECT_EQ(label_heights_px(apart), apart);
  const auto moved = label_heights_px(std::array<double, 4>{340, 100, 340, 335});
  EXPECT_EQ(moved, (std::array<double, 4>{335 + kLabelApart_px, 100, 335 + 2 * kLabelApart_px, 335}));
}

}  // namespace
}  // namespace farfeel::bench
