// A file that takes no rows for long costs rows, and nothing else: what was summed up has every tick.
#include "master_station/report/session_recorder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <future>
#include <vector>

#include "master_station/report/session_csv.h"
#include "tests/support/private_folder.h"
#include "tests/unit/master_station/report/made_up_session.h"

namespace farfeel::master_station {
namespace {

struct SilentRemote final : Remote {
  void send(const ToolState&) noexcept override {}
  bool poll(contact::ContactSet&) noexcept override { return false; }
};

TEST(SessionRecorderTest, AFileThatStallsForLongCostsRowsAndNotTheSums) {
  constexpr std::uint64_t kTicks = 60'000;  // of a minute; 16 s of them may wait
  const test_support::PrivateFolder folder;
  const std::string path = folder.path() + "/session.csv";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  std::promise<void> reads;
  std::uint64_t rows = 0;
  std::jthread disk([&] {
    std::ifstream file(path);
    reads.get_future().wait();
    for (std::string row; std::getline(file, row);) ++rows;
  });
  realtime::SpscQueue<TickRecord> ticks(4096);
  SilentRemote remote;
  ContactWitness witness(remote);
  auto recorder = SessionRecorder::start(path, ticks, witness);
  ASSERT_TRUE(recorder) << recorder.error().message;
  for (std::uint64_t i = 0; i < kTicks;)
    if (ticks.push(made_up_tick(i, kTicks)))
      ++i;
    else
      std::this_thread::sleep_for(SessionRecorder::kDrain);
  while ((*recorder)->newest().time_ns < static_cast<std::int64_t>(kTicks - 1) * 1'000'000)
    std::this_thread::sleep_for(SessionRecorder::kDrain);
  reads.set_value();
  const auto finished = (*recorder)->finish();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().message.find("the disk did not take them in time"), std::string::npos);
  SessionSummary summary;
  (*recorder)->statistics().fill(summary);
  EXPECT_EQ(summary.ticks, kTicks);
  disk.join();
  EXPECT_GT(rows, 10'000U) << "what it took is there";
  EXPECT_LT(rows, kTicks);
}

/// The ticks that a session's file holds, of so many; the fault begins at one of them and lasts ten.
std::vector<std::uint64_t> kept(std::uint64_t ticks, std::uint64_t fault_at, int every_nth_tick) {
  const test_support::PrivateFolder folder;
  const std::string path = folder.path() + "/session.csv";
  auto csv = SessionCsv::create(path, every_nth_tick);
  for (std::uint64_t i = 0; i < ticks; ++i) {
    TickRecord tick;
    tick.time_ns = static_cast<std::int64_t>(i) * 1'000'000;
    if (i >= fault_at && i < fault_at + 10) tick.state = LoopState::kFault;
    csv->append(tick);
  }
  EXPECT_TRUE(csv->close());
  std::ifstream file(path);
  std::string row;
  std::getline(file, row);
  std::vector<std::uint64_t> numbers;
  while (std::getline(file, row)) numbers.push_back(static_cast<std::uint64_t>(std::llround(std::stod(row) * 1e3)));
  return numbers;
}

TEST(SessionCsv, OfALongSessionEverFewerTicksAreKeptButAllAroundAFault) {
  constexpr std::uint64_t kTicks = 16 * SessionCsv::kWhole, kFault = 15 * SessionCsv::kWhole + 7;
  const auto numbers = kept(kTicks, kFault, SessionCsv::kThinsItself);
  EXPECT_TRUE(std::is_sorted(numbers.begin(), numbers.end()));
  EXPECT_EQ(std::adjacent_find(numbers.begin(), numbers.end()), numbers.end()) << "a tick stands there twice";
  const auto between = [&](std::uint64_t low, std::uint64_t high) {
    return std::lower_bound(numbers.begin(), numbers.end(), high) -
           std::lower_bound(numbers.begin(), numbers.end(), low);
  };
  EXPECT_EQ(between(0, SessionCsv::kWhole), SessionCsv::kWhole);
  EXPECT_EQ(between(kFault - SessionCsv::kAround / 2, kFault + SessionCsv::kAround), SessionCsv::kAround * 3 / 2);
  for (std::uint64_t minute = 1; minute < 8; minute *= 2)
    EXPECT_EQ(between(minute * SessionCsv::kWhole, 2 * minute * SessionCsv::kWhole), SessionCsv::kWhole / 2) << minute;
  EXPECT_LT(numbers.size(), 3.2 * SessionCsv::kWhole);
}

TEST(SessionCsv, EveryNthTickIsKeptWhereThatIsAsked) {
  EXPECT_EQ(kept(1000, 5000, 10).size(), 100u);
  EXPECT_EQ(kept(70'000, 80'000, 1).size(), 70'000u);
  EXPECT_EQ(kept(5000, 2500, 100).size(), 2 * SessionCsv::kAround + (5000 - 2 * SessionCsv::kAround) / 100);
}

TEST(SessionCsv, AFullDiskIsToldAsSuch) {
  auto csv = SessionCsv::create("/dev/full");
  ASSERT_TRUE(csv) << csv.error().message;
  for (int i = 0; i < 2000; ++i) {
    csv->append({});
    errno = EAGAIN;  // what a later call may leave there
  }
  const auto closed = csv->close();
  ASSERT_FALSE(closed);
  EXPECT_NE(closed.error().message.find("No space left on device"), std::string::npos) << closed.error().message;
}

}  // namespace
}  // namespace farfeel::master_station
