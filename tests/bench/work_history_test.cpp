#include "tests/bench/work_history.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <fstream>

#include "tests/support/private_folder.h"

namespace farfeel::bench {
namespace {

CountedRow row_of(std::uint64_t samples, std::uint64_t points) {
  CountedRow row{"frame", {}};
  if (samples > 0) row.counts.emplace_back("samples", samples);
  if (points > 0) row.counts.emplace_back("points", points);
  return row;
}

class WorkHistories : public testing::Test {
 protected:
  /// Two entries; the newer one has these counts.
  [[nodiscard]] WorkHistory with(std::uint64_t samples, std::uint64_t points) const {
    add_to_history(path_, "one", "the first", {row_of(1, 1)});
    add_to_history(path_, "two", "more \"samples\"\nare taken", {row_of(samples, points)});
    return WorkHistory(path_);
  }
  test_support::PrivateFolder folder_;
  std::filesystem::path path_ = folder_ / "work.jsonl";
};

TEST_F(WorkHistories, ALineIsAnEntry) {
  const WorkHistory history = with(1000, 10);
  ASSERT_EQ(history.entries().size(), 2u);
  EXPECT_EQ(history.entries()[1]["why"], "more \"samples\"\nare taken");
  EXPECT_EQ(history.entries()[1]["counts"]["frame"]["samples"], 1000);
}

TEST_F(WorkHistories, ThreePercentEitherWayIsTheSame) {
  const WorkHistory history = with(1000, 10);
  EXPECT_TRUE(history.differences({row_of(1030, 10)}).empty());
  EXPECT_TRUE(history.differences({row_of(970, 10)}).empty());
  for (const std::uint64_t samples : {1031, 969}) {
    const auto differences = history.differences({row_of(samples, 10)});
    ASSERT_EQ(differences.size(), 1u);
    EXPECT_EQ(differences[0].row, "frame");
    EXPECT_EQ(differences[0].counter, "samples");
    EXPECT_EQ(differences[0].before, 1000u);
    EXPECT_EQ(differences[0].now, samples);
  }
}

TEST_F(WorkHistories, WorkThatBeginsOrEndsDiffers) {
  const WorkHistory history = with(1000, 0);
  const auto begun = history.differences({row_of(1000, 1)});
  ASSERT_EQ(begun.size(), 1u);
  EXPECT_EQ(begun[0].counter, "points");
  const auto ended = history.differences({row_of(0, 0)});
  ASSERT_EQ(ended.size(), 1u);
  EXPECT_EQ(ended[0].now, 0u);
}

TEST_F(WorkHistories, ARowThatWasNeverCountedDiffers) {
  const CountedRow other{"tick", {{"samples", 1}}};
  EXPECT_EQ(with(1000, 10).differences({other}).size(), 1u);
}

TEST_F(WorkHistories, WhatIsNoHistoryIsRefused) {
  EXPECT_THROW(WorkHistory{path_}, CLI::Error);
  std::ofstream(path_) << "{\"why\": \"no counts\"}\n";
  EXPECT_THROW(WorkHistory{path_}, CLI::Error);
}

}  // namespace
}  // namespace farfeel::bench
