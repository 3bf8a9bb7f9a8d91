// A million triangles, within the memory that is said beforehand.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "slave_sim/bake/bake_within.h"
#include "slave_sim/bake/foreseen.h"
#include "slave_sim/bake/progress_words.h"
#include "tests/support/in_child.h"
#include "tests/support/solids.h"

namespace farfeel::slave_sim {
namespace {

TEST(BoundedTest, AMillionTrianglesTakeNoMoreMemoryThanWasSaid) {
  constexpr std::uint32_t kTexture = 1024;
  const auto said = [](std::size_t triangles) { return static_cast<rlim_t>(foreseen(triangles, kTexture, 1).bytes); };
  const test_support::Outcome outcome = test_support::in_child([&] {
    const geometry::TriangleMesh ball =
        support::bumpy_ball_mesh({.radius_m = 0.03, .bump_m = 4e-4, .sides = 1414, .rows = 355});
    const rlimit space{said(ball.triangles.size()), said(ball.triangles.size())};
    if (setrlimit(RLIMIT_AS, &space) != 0) return std::string("no limit could be set");
    const auto within = bake_within("ball", ball, {}, 50e-6);
    if (!within) return within.error().message;
    const BakeReport& report = within->baked.report;
    // An error of 50 um takes few triangles: the ball is not torn at its poles, where all of it is slivers.
    if (report.beyond_budget > 0 || report.coarse_triangles > 700)
      return "coarse triangles: " + std::to_string(report.coarse_triangles);
    return std::string(within->is_met ? "met" : "not met");
  });
  EXPECT_TRUE(outcome.ended()) << "signal " << outcome.signal();
  EXPECT_EQ(outcome.words, "met");
}

TEST(ForeseenTest, MoreTakesMoreAndTooMuchIsTold) {
  EXPECT_GT(foreseen(1'000'000, 1024, 1).bytes, foreseen(1000, 1024, 1).bytes);
  EXPECT_GT(foreseen(1000, 4096, 1).bytes, foreseen(1000, 1024, 1).bytes);
  EXPECT_GT(foreseen(1000, 1024, 12).seconds, foreseen(1000, 1024, 1).seconds);
  EXPECT_FALSE(words_about_memory({.bytes = 1e6, .seconds = 1}));
  const auto words = words_about_memory({.bytes = 1e18, .seconds = 1});
  ASSERT_TRUE(words);
  EXPECT_NE(words->find("1e+09 GB"), std::string::npos) << *words;
}

TEST(ForeseenTest, TheLargestTextureThatFitsIsTaken) {
  const auto takes = [](std::uint32_t texture) { return foreseen(100'000, texture, 1).bytes; };
  EXPECT_EQ(texture_within(1e18, 100'000, 4096), 4096U);
  EXPECT_EQ(texture_within(takes(4096), 100'000, 4096), 4096U);
  EXPECT_EQ(texture_within(0.99 * takes(4096), 100'000, 4096), 2048U);
  EXPECT_EQ(texture_within(takes(256), 100'000, 4096), 256U);
  EXPECT_EQ(texture_within(0.99 * takes(256), 100'000, 4096), std::nullopt);
}

TEST(ProgressWordsTest, TellTheTimeLeftOnceThereIsSomethingToGoBy) {
  EXPECT_EQ(progress_words("rays", 0.25, 10), " 25 % rays, at most 0:30 left");
  EXPECT_EQ(progress_words("rays", 0.5, 100), " 50 % rays, at most 1:40 left");
  EXPECT_EQ(progress_words("mass", 0, 5), "  0 % mass");
  EXPECT_EQ(progress_words("mass", 0.1, 0.1), " 10 % mass");
}

}  // namespace
}  // namespace farfeel::slave_sim
