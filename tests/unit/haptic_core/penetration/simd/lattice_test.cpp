#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "haptic_core/penetration/simd/simd_kernels.h"

namespace farfeel::penetration::simd {
namespace {

std::vector<const Kernels*> kernels_here() {
  std::vector<const Kernels*> kernels{&kPlain};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) kernels.push_back(&kAvx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
    kernels.push_back(&kAvx512);
  }
#endif
  return kernels;
}

struct Columns {
  std::vector<float> u, v, s_z, t_z, s_u, s_v, t_u, t_v, bow, stands;

  explicit Columns(std::size_t room)
      : u(room),
        v(room),
        s_z(room),
        t_z(room),
        s_u(room),
        s_v(room),
        t_u(room),
        t_v(room),
        bow(room),
        stands(room, 1) {}
  [[nodiscard]] LaneCells lanes() {
    LaneCells cells{};
    cells.u = u.data(), cells.v = v.data(), cells.s_z = s_z.data(), cells.t_z = t_z.data();
    cells.s_u = s_u.data(), cells.s_v = s_v.data(), cells.t_u = t_u.data(), cells.t_v = t_v.data();
    cells.bow = bow.data(), cells.stands = stands.data();
    return cells;
  }
};

constexpr std::size_t kMost = 4000;

/// Whatever the steps: cells that tile a place get each node of it once, in whatever order they come.
TEST(Lattice, EveryNodeBelongsToOneCell) {
  constexpr int kWide = 13, kHigh = 9;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int trial = 0; trial < 300; ++trial) {
    const double cell_m = 1e-4 + 3e-4 * unit(random);
    const double step_m = trial % 4 == 0 ? cell_m / (1 + trial % 3) : cell_m * (0.25 + 1.2 * unit(random));
    const double origin[2] = {0.3 * (unit(random) - 0.5), 2 * unit(random)};
    const double first[2] = {std::round((0.02 * unit(random) - origin[0]) / cell_m),
                             std::round((0.01 - origin[1]) / cell_m)};
    Columns cells(kWide * kHigh), nodes(kMost + kMostLanes);
    std::vector<std::uint32_t> chosen(cells.u.size());
    std::iota(chosen.begin(), chosen.end(), 0u);
    std::shuffle(chosen.begin(), chosen.end(), random);
    for (std::size_t k = 0; k < cells.u.size(); ++k) {
      cells.u[k] = static_cast<float>(origin[0] + (first[0] + static_cast<double>(k % kWide) + 0.5) * cell_m);
      cells.v[k] = static_cast<float>(origin[1] + (first[1] + static_cast<double>(k / kWide) + 0.5) * cell_m);
    }
    const LayTask task{.origin = {origin[0], origin[1]},
                       .cell = cell_m,
                       .step = step_m,
                       .low = {-1e9, -1e9},
                       .high = {1e9, 1e9},
                       .half = 0,
                       .lowest = kNowhere,
                       .chosen = static_cast<std::int32_t>(chosen.size()),
                       .most = kMost};
    const auto between = [&](double low, double many) {
      return std::ceil((low + many) * cell_m / step_m - 0.5) - std::ceil(low * cell_m / step_m - 0.5);
    };
    for (const Kernels* kernels : kernels_here()) {
      const auto laid = kernels->lay(task, cells.lanes(), chosen.data(), nodes.lanes());
      ASSERT_LE(laid, task.most);
      std::vector<std::pair<long, long>> found;
      for (std::size_t k = 0; k < static_cast<std::size_t>(laid); ++k) {
        found.emplace_back(std::lround((static_cast<double>(nodes.u[k]) - origin[0]) / step_m - 0.5),
                           std::lround((static_cast<double>(nodes.v[k]) - origin[1]) / step_m - 0.5));
      }
      std::sort(found.begin(), found.end());
      EXPECT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end()) << "one was laid twice";
      EXPECT_EQ(laid, static_cast<std::int32_t>(between(first[0], kWide) * between(first[1], kHigh)));
    }
  }
}

/// One cell with a slope and a bow: places follow the slope, those that cannot reach the mark are left out, and no
/// other; a window's end that cuts through it leaves it what stands for the window beyond.
TEST(Lattice, PlacesFollowTheSlopesAndAreLeftOutByTheirBound) {
  constexpr double kCell_m = 3e-4;
  Columns cell(1), places(100);
  cell.u[0] = cell.v[0] = static_cast<float>(0.5 * kCell_m);
  cell.s_z[0] = 1e-3f, cell.s_u[0] = 0.5f, cell.s_v[0] = -0.25f, cell.t_u[0] = 0.125f, cell.bow[0] = 20e-6f;
  const std::uint32_t chosen = 0;
  LayTask task{.origin = {0, 0},
               .cell = kCell_m,
               .step = 1e-4,
               .low = {-1, -1},
               .high = {1, 1},
               .half = 0.5e-4f,
               .lowest = kNowhere,
               .chosen = 1,
               .most = 50};
  for (const Kernels* kernels : kernels_here()) {
    const auto lay = [&] { return kernels->lay(task, cell.lanes(), &chosen, places.lanes()); };
    task.lowest = kNowhere;
    ASSERT_EQ(lay(), 9);
    int reach = 0;
    task.lowest = 1.02e-3f;
    for (std::size_t k = 0; k < 9; ++k) {
      const float du = places.u[k] - cell.u[0], dv = places.v[k] - cell.v[0];
      EXPECT_NEAR(places.s_z[k], 1e-3f + 0.5f * du - 0.25f * dv, 1e-9f);
      EXPECT_NEAR(places.t_z[k], 0.125f * du, 1e-9f);
      const float far_u = std::abs(du) + task.half, far_v = std::abs(dv) + task.half;
      const float bows = (far_u * far_u + far_v * far_v) / static_cast<float>(0.5 * kCell_m * kCell_m);
      const float bound = places.s_z[k] - places.t_z[k] + 0.625f * task.half + 20e-6f * bows;
      reach += bound >= task.lowest;
    }
    EXPECT_TRUE(reach > 0 && reach < 9);
    EXPECT_EQ(lay(), reach);
    task.lowest = kNowhere;
    cell.s_z[0] = std::nanf(""), task.lowest = 1;
    EXPECT_EQ(lay(), 9) << "where nothing was sampled nothing is left out";
    cell.s_z[0] = 1e-3f, task.lowest = kNowhere;
    task.most = 8;
    EXPECT_GT(lay(), task.most);
    task.most = 50, task.step = 2.2e-4;
    EXPECT_EQ(lay(), 1) << "the next node of a row is the next cell's";
    task.high[0] = 2.5e-4;
    EXPECT_EQ(lay(), 2) << "there is no next cell, and it stands for 2.2e-4 to 4.4e-4";
    task.high[0] = 1, task.step = 1e-4;
  }
}

}  // namespace
}  // namespace farfeel::penetration::simd
