// The bottleneck's law against a queue that is emptied bit by bit.
#include "tests/bench/packet_fifo.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <random>

namespace farfeel::bench {
namespace {

constexpr std::int64_t kBit_ns = 100;  // 10 Mbit/s

transport::LinkSpec narrow() {
  transport::LinkSpec spec;
  spec.rate_bit_per_s = 1e9 / kBit_ns;
  spec.round_trip_ns = 20'000'000;
  spec.queue_ns = 3'000'000;
  return spec;
}

struct Arrival {
  std::int64_t time_ns;
  std::size_t bytes;
};

/// Bursts and pauses, so that the queue is empty, long and full in turn.
std::vector<Arrival> traffic(unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Arrival> arrivals;
  std::int64_t time_ns = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool is_busy = (i / 100) % 3 != 0;
    time_ns += kBit_ns * static_cast<std::int64_t>(random() % (is_busy ? 8'000 : 30'000));
    arrivals.push_back({time_ns, 20 + random() % (PacketFifo::kMostBytes - 20)});
  }
  return arrivals;
}

/// When each packet's last bit has left, by its place among the arrivals; a bit leaves every kBit_ns while there are
/// any.
std::map<std::size_t, std::int64_t> bit_by_bit(const std::vector<Arrival>& arrivals, std::int64_t queue_ns) {
  struct Waiting {
    std::size_t number;
    std::size_t bits;
  };
  std::map<std::size_t, std::int64_t> left;
  std::deque<Waiting> queue;
  std::size_t next = 0;
  for (std::int64_t now_ns = 0; next < arrivals.size() || !queue.empty(); now_ns += kBit_ns) {
    if (!queue.empty() && --queue.front().bits == 0) {
      left[queue.front().number] = now_ns;
      queue.pop_front();
    }
    for (; next < arrivals.size() && arrivals[next].time_ns == now_ns; ++next) {
      std::size_t ahead = 0;
      for (const Waiting& w : queue) ahead += w.bits;
      if (static_cast<std::int64_t>(ahead) * kBit_ns <= queue_ns) queue.push_back({next, 8 * arrivals[next].bytes});
    }
  }
  return left;
}

TEST(PacketFifo, LetsPacketsOutAsAQueueThatIsEmptiedBitByBit) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const transport::LinkSpec spec = narrow();
    const auto arrivals = traffic(seed);
    const auto expected = bit_by_bit(arrivals, spec.queue_ns);
    PacketFifo fifo(spec, 1, 4096);
    for (std::size_t i = 0; i < arrivals.size(); ++i) {
      std::memcpy(fifo.room().data(), &i, sizeof i);
      fifo.push(arrivals[i].bytes, arrivals[i].time_ns);
    }
    EXPECT_GT(fifo.counters().queue_dropped, 0u);
    EXPECT_EQ(fifo.counters().queue_dropped, arrivals.size() - expected.size());
    for (const auto& [number, left_ns] : expected) {
      ASSERT_EQ(fifo.next_ns(), left_ns + spec.round_trip_ns / 2) << "packet " << number;
      const auto packet = fifo.pop();
      std::size_t told = 0;
      std::memcpy(&told, packet.data(), sizeof told);
      EXPECT_EQ(told, number);
      EXPECT_EQ(packet.size(), arrivals[number].bytes);
    }
    EXPECT_EQ(fifo.next_ns(), std::numeric_limits<std::int64_t>::max());
  }
}

TEST(PacketFifo, DropsAndCountsWhatItHasNoRoomFor) {
  transport::LinkSpec spec;
  PacketFifo fifo(spec, 1, 8);
  for (int i = 0; i < 20; ++i) fifo.push(100, i);
  EXPECT_EQ(fifo.overflow(), 13u);  // one place is for the packet that comes next
  int count = 0;
  for (; fifo.next_ns() < 1000; ++count) (void)fifo.pop();
  EXPECT_EQ(count, 7);
}

TEST(PacketFifo, LosesInBursts) {
  transport::LinkSpec spec;
  spec.loss = 0.01;
  spec.burst = 4;
  constexpr std::uint64_t kPackets = 400'000;
  PacketFifo fifo(spec, 3, 8);
  std::uint64_t bursts = 0, before = 0;
  bool was_lost = false;
  for (std::uint64_t i = 0; i < kPackets; ++i) {
    fifo.push(100, static_cast<std::int64_t>(i));
    while (fifo.next_ns() <= static_cast<std::int64_t>(i)) (void)fifo.pop();
    const bool is_lost = fifo.counters().lost > before;
    before = fifo.counters().lost;
    bursts += is_lost && !was_lost ? 1 : 0;
    was_lost = is_lost;
  }
  const auto lost = static_cast<double>(fifo.counters().lost);
  // 1,000 bursts: a tenth is three of their standard deviations.
  EXPECT_NEAR(lost / kPackets, 0.01, 0.0015);
  EXPECT_NEAR(lost / static_cast<double>(bursts), 4, 0.4);
}

}  // namespace
}  // namespace farfeel::bench
