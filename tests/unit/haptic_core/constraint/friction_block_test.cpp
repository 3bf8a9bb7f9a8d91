#include "haptic_core/constraint/friction_block.h"

#include <gtest/gtest.h>

#include <random>

namespace farfeel::constraint {
namespace {

TEST(FrictionBlock, DragsStraightAgainstTheSlip) {
  std::mt19937 random(3);
  std::normal_distribution<> normal;
  for (int i = 0; i < 5000; ++i) {
    Block<3> any = Block<3>::NullaryExpr([&] { return normal(random); });
    // An arm makes one direction a hundred times as soft as another.
    any.col(0) *= std::pow(100, std::uniform_real_distribution<>(0, 1)(random));
    const Block<3> W = 1e-4 * (any * any.transpose() + 0.1 * Block<3>::Identity());
    const BlockVector<3> b = BlockVector<3>::NullaryExpr([&] { return 1e-3 * normal(random); });
    const double most = 0.999 * std::uniform_real_distribution<>(0.001, 1)(random) * (W.inverse() * b).norm();
    const BlockVector<3> f = dragging_force<3>(W, b, most);
    ASSERT_NEAR(f.norm(), most, 1e-12 * most);
    const BlockVector<3> slip = W * f - b;
    ASSERT_LE((slip + slip.norm() / most * f).norm(), 1e-5 * slip.norm()) << i;
  }
  EXPECT_EQ(dragging_force<2>(Block<2>::Identity(), {1, 0}, 0), BlockVector<2>(0, 0));
}

}  // namespace
}  // namespace farfeel::constraint
