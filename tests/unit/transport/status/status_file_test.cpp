#include "transport/status/status_file.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/support/private_folder.h"

namespace farfeel::transport {
namespace {

LinkStatus some_status() {
  LinkStatus status;
  status.role = "master";
  status.pid = getpid();
  status.peer = "[fe80::1%eth0]:47000";
  status.peer_name = "bench \"\xFF";  // not UTF-8
  status.haptic.up.sent = 0xFFFF'FFFF'FFFF'FFFF;
  status.haptic.down.one_way_excess = {1, 2.5, 3, 4};
  status.haptic.round_trip.p99_ms = 7;
  status.bulk.migrations = 3;
  status.bulk_pace.message_bytes = 1200;
  return status;
}

class StatusFileTest : public testing::Test {
 protected:
  test_support::PrivateFolder private_folder_;
  const std::string folder_ = private_folder_.path();
};

TEST_F(StatusFileTest, WhatIsWrittenIsRead) {
  {
    const auto file = StatusFile::open(folder_);
    ASSERT_TRUE(file);
    file->write({});
    file->write(some_status());
    const auto all = read_link_statuses(folder_);
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].role, "master");
    EXPECT_EQ(all[0].peer, "[fe80::1%eth0]:47000");
    EXPECT_EQ(all[0].haptic.up.sent, 0xFFFF'FFFF'FFFF'FFFF);
    EXPECT_EQ(all[0].haptic.down.one_way_excess.p99_ms, 2.5);
    EXPECT_EQ(all[0].haptic.round_trip.p99_ms, 7);
    EXPECT_TRUE(std::isnan(all[0].haptic.round_trip.p50_ms));
    EXPECT_EQ(all[0].bulk.migrations, 3u);
    EXPECT_EQ(all[0].bulk_pace.message_bytes, 1200u);
    EXPECT_GE(all[0].age_s, -0.1);
    EXPECT_LT(all[0].age_s, 60);
  }
}

TEST_F(StatusFileTest, AFileOfAKilledProgramIsSweptUpAndJunkIsLeftOut) {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  LinkStatus status = some_status();
  status.pid = child;
  const std::string dead = folder_ + "/" + std::to_string(child) + ".json";
  std::ofstream(dead) << to_json(status);
  std::ofstream(folder_ + "/1.json") << "{\"role\": 5}";
  std::ofstream(folder_ + "/junk.json") << std::string(1'000'000, '[');
  EXPECT_TRUE(read_link_statuses(folder_).empty());
  EXPECT_FALSE(std::filesystem::exists(dead));
  EXPECT_TRUE(std::filesystem::exists(folder_ + "/1.json"));
  EXPECT_TRUE(read_link_statuses(folder_ + "/none").empty());
}

TEST_F(StatusFileTest, EveryCutTextIsRefused) {
  const std::string text = to_json(some_status());
  ASSERT_TRUE(link_status_from_json(text));
  for (std::size_t i = 0; i + 2 < text.size(); ++i) EXPECT_FALSE(link_status_from_json(text.substr(0, i))) << i;
}

}  // namespace
}  // namespace farfeel::transport
