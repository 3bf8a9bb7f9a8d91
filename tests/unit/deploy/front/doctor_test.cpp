// What the doctor says of a loop's machine made of files, and of a link by a session's figures.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "deploy/front/link_doctor.h"
#include "deploy/front/loop_doctor.h"
#include "master_station/report/session_summary.h"
#include "tests/support/private_folder.h"
#include "transport/status/link_status.h"

namespace farfeel::front {
namespace {

namespace fs = std::filesystem;

#define EXPECT_TELLS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

std::string told(const std::vector<Finding>& findings) {
  std::string all;
  for (const Finding& f : findings)
    all += std::string(f.health == Health::kGood      ? "good "
                       : f.health == Health::kLimited ? "limited "
                                                      : "missing ") +
           f.what + ": " + f.seen + (f.remedy.empty() ? "" : " -> " + f.remedy) + "\n";
  return all;
}

class LoopDoctor : public testing::Test {
 protected:
  void file(const std::string& path, const std::string& text) const {
    fs::create_directories(fs::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text << "\n";
  }
  [[nodiscard]] std::string told_of_it() const { return told(examine_loop({root_, {}})); }
  test_support::PrivateFolder folder_;
  const std::string root_ = folder_.path();
};

TEST_F(LoopDoctor, OfAnEmptyMachineIsContent) {
  for (const Finding& finding : examine_loop({root_, {}})) EXPECT_EQ(finding.health, Health::kGood) << finding.what;
}

TEST_F(LoopDoctor, OneCoreThatSavesPowerIsToldWithTheCommandThatMendsIt) {
  file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance");
  EXPECT_TELLS(told_of_it(), "good clock governor: performance");
  file("/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave");
  EXPECT_TELLS(told_of_it(), "limited clock governor: performance, powersave");
  EXPECT_TELLS(told_of_it(), "cpupower frequency-set --governor performance");
}

TEST_F(LoopDoctor, IsolatedCoresAndTheThrottleAreTold) {
  file("/sys/devices/system/cpu/isolated", "2-3");
  EXPECT_TELLS(told_of_it(), "isolated cores: 2-3; start the master with  taskset -c 2-3");
  file("/proc/sys/kernel/sched_rt_period_us", "1000000");
  file("/proc/sys/kernel/sched_rt_runtime_us", "950000");
  EXPECT_TELLS(told_of_it(), "good real-time throttle: real-time threads get 95 % of each 1000 ms");
  file("/proc/sys/kernel/sched_rt_runtime_us", "500000");
  EXPECT_TELLS(told_of_it(), "limited real-time throttle: real-time threads get 50 %");
  EXPECT_TELLS(told_of_it(), "sysctl kernel.sched_rt_runtime_us=950000");
  file("/proc/sys/kernel/sched_rt_runtime_us", "-1");
  EXPECT_TELLS(told_of_it(), "good real-time throttle: off");
}

struct Session {
  master_station::SessionSummary summary;
  transport::LinkStatus status;
  Session() {
    summary.seconds = 5;
    summary.rtt_ms.p50 = 20, summary.rtt_ms.p99 = 25;
    summary.up = {5000, 4990, 10}, summary.down = {4000, 4000, 0};
    summary.loop.rung = "tiles";
    summary.local_model.tiles_share = 0.99;
    status.bulk.longest_bytes = 1232;
    status.haptic.down.dscp = 46, status.bulk.down.dscp = 1;
  }
  [[nodiscard]] std::string told_of_it(const std::vector<std::string>& mind = {}) const {
    return told(link_findings(summary, status, mind));
  }
};

TEST(LinkDoctor, AGoodLinkIsToldWithItsFigures) {
  const std::string said = Session().told_of_it();
  EXPECT_EQ(said.find("limited"), std::string::npos) << said;
  EXPECT_TELLS(said, "round trip: p50 20.0, p99 25.0 ms");
  EXPECT_TELLS(said, "0.20 % of 5000 poses, 0.00 % of 4000 contact sets");
  EXPECT_TELLS(said, "packets of 1260 bytes pass");
  EXPECT_TELLS(said, "DSCP 46, tiles and scene with 1");
  EXPECT_TELLS(said, "is felt; level tiles: the surfaces themselves in 99 % of the ticks");
}

TEST(LinkDoctor, WhatABadLinkLacksIsToldWithWhatToDo) {
  Session session;
  session.summary.rtt_ms.p50 = 1500;
  session.summary.up = {5000, 3500, 1500};
  session.status.haptic.down.dscp = 0;
  session.summary.local_model.tiles_share = 0.3;
  const std::string said = session.told_of_it({"the link is too narrow"});
  EXPECT_TELLS(said, "missing round trip: p50 1500.0");
  EXPECT_TELLS(said, "limited loss: 30.00 % of 5000 poses");
  EXPECT_TELLS(said, "limited marks (DSCP): contacts arrive with DSCP 0");
  EXPECT_TELLS(said, "limited texture: is felt now and then;");
  EXPECT_TELLS(said, "limited the link: the link is too narrow");
}

}  // namespace
}  // namespace farfeel::front
