#include "master_station/report/run_folder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>

#include "master_station/report/report_page.h"
#include "tests/support/private_folder.h"

namespace farfeel::master_station {
namespace {

namespace fs = std::filesystem;

TEST(RunFolder, TwoRunsAtOnceDoNotShareOne) {
  const test_support::PrivateFolder place;
  auto first = RunFolder::take(place / "a");
  ASSERT_TRUE(first) << first.error().message;
  const auto second = RunFolder::take(place / "a");
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find(place / "a"), std::string::npos) << second.error().message;
  EXPECT_NE(second.error().message.find("--out"), std::string::npos) << second.error().message;
  EXPECT_TRUE(RunFolder::take(place / "b"));
  { const RunFolder ended(*std::move(first)); }
  EXPECT_TRUE(RunFolder::take(place / "a")) << "it is free once the run is over";
}

TEST(RunFolder, EachRunHasANewOneAndLatestIsTheOneThatBeganLast) {
  const test_support::PrivateFolder place;
  const auto first = RunFolder::make_new(place / "runs");
  ASSERT_TRUE(first) << first.error().message;
  std::ofstream(first->path() + "/" + kReportFile) << "first";
  first->begin();
  EXPECT_FALSE(fs::exists(first->path() + "/" + kReportFile));
  std::ofstream(first->path() + "/" + kReportFile) << "first";
  const fs::path latest = place / "runs/latest";
  EXPECT_EQ(fs::canonical(latest), fs::canonical(first->path()));
  const auto second = RunFolder::make_new(place / "runs");
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_NE(second->path(), first->path()) << "within the same second, too";
  EXPECT_EQ(fs::canonical(latest), fs::canonical(first->path())) << "the second has not begun";
  second->begin();
  EXPECT_EQ(fs::canonical(latest), fs::canonical(second->path()));
  EXPECT_TRUE(fs::exists(first->path() + "/" + kReportFile)) << "nothing of an older run is touched";
}

TEST(RunFolder, ANewOneThatNothingWasPutInGoes) {
  const test_support::PrivateFolder place;
  std::string unused, used;
  {
    const auto one = RunFolder::make_new(place / "runs"), other = RunFolder::make_new(place / "runs");
    unused = one->path(), used = other->path();
    std::ofstream(used + "/slave.log") << "no such scene";
  }
  EXPECT_FALSE(fs::exists(unused));
  EXPECT_TRUE(fs::exists(used));
  const std::string named = place / "named";
  { const auto kept = RunFolder::take(named); }
  EXPECT_TRUE(fs::exists(named));
}

TEST(RunFolder, AFolderOfAPersonsOwnNamedLatestStays) {
  const test_support::PrivateFolder place;
  fs::create_directories(place / "runs/latest");
  std::ofstream(place / "runs/latest/mine.txt") << "mine";
  const auto run = RunFolder::make_new(place / "runs");
  ASSERT_TRUE(run);
  run->begin();
  EXPECT_TRUE(fs::exists(place / "runs/latest/mine.txt"));
  EXPECT_EQ(std::distance(fs::directory_iterator(place / "runs"), fs::directory_iterator()), 2);
}

TEST(RunFolder, OneThatCannotBeMadeIsTold) {
  const test_support::PrivateFolder place;
  std::ofstream(place / "file") << "no folder";
  for (const auto& run :
       {RunFolder::take(place / "file/a"), RunFolder::make_new(place / "file"), RunFolder::take(place / "file")}) {
    ASSERT_FALSE(run);
    EXPECT_NE(run.error().message.find(place / "file"), std::string::npos) << run.error().message;
  }
}

}  // namespace
}  // namespace farfeel::master_station
