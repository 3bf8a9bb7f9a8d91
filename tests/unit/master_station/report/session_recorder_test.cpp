// A file that takes no rows for long costs rows, and nothing else: what was summed up has every tick.
#include "master_station/report/session_recorder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>
#include <fstream>
#include <future>

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
