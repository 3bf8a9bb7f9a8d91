#include "haptic_core/penetration/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace farfeel::penetration {
namespace {

struct Columns {
  std::vector<float> u, v, s_z, t_z, s_u, s_v, t_u, t_v;

  explicit Columns(std::size_t room)
      : u(room), v(room), s_z(room), t_z(room), s_u(room), s_v(room), t_u(room), t_v(room) {}
  [[nodiscard]] simd::LaneCells lanes() {
    simd::LaneCells cells{};
    cells.u = u.data(), cells.v = v.data(), cells.s_z = s_z.data(), cells.t_z = t_z.data();
    cells.s_u = s_u.data(), cells.s_v = s_v.data(), cells.t_u = t_u.data(), cells.t_v = t_v.data();
    return cells;
  }
};

/// Whatever the steps: cells that tile a place get each node of it once, in whatever order they come; chosen ones get
/// those that lie in them.
TEST(Lattice, EveryNodeBelongsToOneCell) {
  constexpr int kWide = 13, kHigh = 9;
  constexpr std::size_t kMost = 4000;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 400; ++trial) {
    const double cell_m = 1e-4 + 3e-4 * unit(random);
    const double step_m = trial % 4 == 0 ? cell_m / (1 + trial % 3) : cell_m * (0.3 + 1.2 * unit(random));
    const glm::dvec2 origin{0.3 * (unit(random) - 0.5), 2 * unit(random)};
    const glm::dvec2 first = glm::round((glm::dvec2{0.02 * unit(random), 0.01} - origin) / cell_m);
    Columns cells(kWide * kHigh), nodes(kMost + simd::kMostLanes);
    std::vector<std::uint32_t> chosen(cells.u.size());
    std::iota(chosen.begin(), chosen.end(), 0u);
    std::shuffle(chosen.begin(), chosen.end(), random);
    for (std::size_t k = 0; k < cells.u.size(); ++k) {
      cells.u[k] = static_cast<float>(origin.x + (first.x + static_cast<double>(k % kWide) + 0.5) * cell_m);
      cells.v[k] = static_cast<float>(origin.y + (first.y + static_cast<double>(k / kWide) + 0.5) * cell_m);
    }
    const Lattices lattices{origin, cell_m, step_m, {glm::dvec2{-1e9}, glm::dvec2{1e9}}};
    const auto laid = lay(lattices, cells.lanes(), chosen, kMost, nodes.lanes());
    ASSERT_LE(laid, kMost);
    std::vector<std::pair<long, long>> found;
    for (std::size_t k = 0; k < laid; ++k) {
      found.emplace_back(std::lround((static_cast<double>(nodes.u[k]) - origin.x) / step_m - 0.5),
                         std::lround((static_cast<double>(nodes.v[k]) - origin.y) / step_m - 0.5));
    }
    std::sort(found.begin(), found.end());
    EXPECT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end()) << "one was laid twice";
    const auto between = [&](double low, double cells_many) {
      return std::ceil((low + cells_many) * cell_m / step_m - 0.5) - std::ceil(low * cell_m / step_m - 0.5);
    };
    EXPECT_EQ(laid, static_cast<std::size_t>(between(first.x, kWide) * between(first.y, kHigh)));
  }
}

/// A window's end cuts through the last cells; beyond them are nodes that stand for some of the window. And heights go
/// along the cell's slopes.
TEST(Lattice, NodesStandForAllOfTheWindowAndFollowTheSlopes) {
  constexpr double kCell_m = 3e-4, kStep_m = 2.2e-4;
  Columns cells(1), nodes(100);
  cells.u[0] = cells.v[0] = static_cast<float>(0.5 * kCell_m);
  cells.s_z[0] = 1e-3f, cells.s_u[0] = 0.5f, cells.s_v[0] = -0.25f, cells.t_u[0] = 0.125f;
  const std::vector<std::uint32_t> chosen{0};
  const auto laid = [&](double high_m) {
    return lay({{0, 0}, kCell_m, kStep_m, {{-1, -1}, {high_m, 1}}}, cells.lanes(), chosen, 50, nodes.lanes());
  };
  EXPECT_EQ(laid(1), 1u) << "the next node of a row is the next cell's";
  EXPECT_EQ(laid(2.5e-4), 2u) << "there is no next cell, and it stands for 2.2e-4 to 4.4e-4";
  for (std::size_t k = 0; k < 2; ++k) {
    const float du = nodes.u[k] - cells.u[0], dv = nodes.v[k] - cells.v[0];
    EXPECT_NEAR(nodes.s_z[k], 1e-3f + 0.5f * du - 0.25f * dv, 1e-9f);
    EXPECT_NEAR(nodes.t_z[k], 0.125f * du, 1e-9f);
  }
  EXPECT_GT(lay({{0, 0}, kCell_m, 1e-5, {{-1, -1}, {1, 1}}}, cells.lanes(), chosen, 50, nodes.lanes()), 50u);
}

}  // namespace
}  // namespace farfeel::penetration
