#include "master_station/report/session_trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "master_station/report/session_csv.h"
#include "tests/support/private_folder.h"
#include "tests/unit/master_station/report/made_up_session.h"

namespace farfeel::master_station {
namespace {

class SessionTraceTest : public testing::Test {
 protected:
  void write(std::uint64_t ticks) {
    auto csv = SessionCsv::create(path_);
    ASSERT_TRUE(csv) << csv.error().message;
    for (std::uint64_t i = 0; i < ticks; ++i) {
      TickRecord tick = made_up_tick(i, ticks);
      if (i == peak_at_) tick.F_hand_W.force_N.x = 99;
      csv->append(tick);
    }
    ASSERT_TRUE(csv->close());
  }
  static const TraceLine& line(const SessionTrace& trace, std::string_view name) {
    return *std::find_if(trace.lines.begin(), trace.lines.end(), [&](const TraceLine& l) { return l.name == name; });
  }

  test_support::PrivateFolder folder_;
  const std::string path_ = folder_ / "session.csv";
  std::uint64_t peak_at_ = 777;
};

TEST_F(SessionTraceTest, EveryTickIsThereWhileTheyFit) {
  write(1000);
  const auto trace = read_session_csv(path_, 1000);
  ASSERT_TRUE(trace) << trace.error().message;
  EXPECT_EQ(trace->rows, 1000u);
  EXPECT_EQ(trace->rows_per_bucket, 1u);
  const TraceLine& force = line(*trace, "hand_force_N");
  for (std::size_t i = 0; i < 1000; ++i) {
    TickRecord tick = made_up_tick(i, 1000);
    if (i == peak_at_) tick.F_hand_W.force_N.x = 99;
    EXPECT_NEAR(trace->time_s[i], static_cast<double>(i) * 1e-3, 1e-6);
    EXPECT_EQ(trace->state[i], static_cast<std::uint8_t>(tick.state));
    EXPECT_NEAR(force.low[i], glm::length(tick.F_hand_W.force_N), 1e-4);
    EXPECT_EQ(force.low[i], force.high[i]);
  }
}

// Whatever the length of a session and the room for it, the buckets are those of the slow obvious way: rows grouped
// in a power of two, least and greatest of each group.
TEST_F(SessionTraceTest, BucketsKeepEveryPeak) {
  for (const std::uint64_t ticks : {1u, 2u, 9u, 1000u, 2049u, 3333u}) {
    write(ticks);
    const auto all = read_session_csv(path_, 1'000'000);
    ASSERT_TRUE(all);
    for (const std::size_t room : {2u, 3u, 7u, 100u, 1024u}) {
      const auto trace = read_session_csv(path_, room);
      ASSERT_TRUE(trace);
      const std::size_t group = trace->rows_per_bucket;
      ASSERT_LE(trace->time_s.size(), room);
      ASSERT_EQ(trace->time_s.size(), (ticks + group - 1) / group);
      EXPECT_TRUE(group == 1 || trace->time_s.size() * 2 > room);
      for (const char* name : {"hand_force_x_N", "rtt_ms", "contacts"}) {
        const TraceLine& plain = line(*all, name);
        const TraceLine& bucketed = line(*trace, name);
        for (std::size_t bucket = 0; bucket < trace->time_s.size(); ++bucket) {
          float low = std::numeric_limits<float>::quiet_NaN(), high = low;
          for (std::size_t i = bucket * group; i < std::min<std::size_t>((bucket + 1) * group, ticks); ++i) {
            low = std::fmin(low, plain.low[i]);
            high = std::fmax(high, plain.high[i]);
          }
          EXPECT_TRUE(bucketed.low[bucket] == low || (std::isnan(low) && std::isnan(bucketed.low[bucket])));
          EXPECT_TRUE(bucketed.high[bucket] == high || (std::isnan(high) && std::isnan(bucketed.high[bucket])));
        }
      }
    }
  }
}

TEST_F(SessionTraceTest, ARowCutShortIsLeftOut) {
  write(10);
  std::ifstream whole(path_);
  std::string text(std::istreambuf_iterator<char>(whole), {});
  std::ofstream(path_) << text.substr(0, text.size() - 30);
  const auto trace = read_session_csv(path_);
  ASSERT_TRUE(trace);
  EXPECT_EQ(trace->rows, 9u);
  std::ofstream(path_) << text.substr(0, text.size() - 1);  // whole but for its new line: who knows
  EXPECT_EQ(read_session_csv(path_)->rows, 9u);
}

TEST_F(SessionTraceTest, SaysWhatIsWrong) {
  EXPECT_NE(read_session_csv("/nowhere/session.csv").error().message.find("/nowhere/session.csv"), std::string::npos);
  std::ofstream(path_) << "a,b\n1,2\n";
  EXPECT_NE(read_session_csv(path_).error().message.find("no session.csv"), std::string::npos);
}

TEST_F(SessionTraceTest, AnyBytesMakeATraceOrAnError) {
  write(50);
  std::ifstream whole(path_);
  const std::string text(std::istreambuf_iterator<char>(whole), {});
  std::mt19937 random(1);
  for (int round = 0; round < 100; ++round) {
    std::string broken = text;
    for (int i = 0; i < 20; ++i) broken[random() % broken.size()] = static_cast<char>(random() % 256);
    std::ofstream(path_, std::ios::binary) << broken;
    const auto trace = read_session_csv(path_, 16);
    if (!trace) continue;
    for (const TraceLine& l : trace->lines) EXPECT_EQ(l.low.size(), trace->time_s.size());
  }
}

}  // namespace
}  // namespace farfeel::master_station
