#include "transport/net/arrival_clock.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond = 1000 * kMs;

// A machine whose wall clock is stepped, with a socket in front of which datagrams are stamped.
struct Machine {
  std::int64_t monotonic = 1000 * kSecond;
  std::int64_t offset = 1'700'000'000 * kSecond;
  [[nodiscard]] ClockReading read() const { return {monotonic, monotonic + offset, 60}; }
  [[nodiscard]] std::int64_t stamp() const { return monotonic + offset; }
};

TEST(ArrivalClock, TellsHowLongADatagramWaited) {
  Machine machine;
  ArrivalClock clock(machine.read());
  const std::int64_t arrived = machine.monotonic += 5 * kMs;
  const std::int64_t stamp = machine.stamp();
  machine.monotonic += 300 * kSecond;  // a process that was stopped for long
  const auto arrival = clock.arrival(stamp, machine.read());
  EXPECT_TRUE(arrival.is_known);
  EXPECT_EQ(arrival.time_ns, arrived);
}

class Stepped : public testing::TestWithParam<std::int64_t> {};

TEST_P(Stepped, WhileADatagramWaits) {
  Machine machine;
  ArrivalClock clock(machine.read());
  machine.monotonic += 5 * kMs;
  clock.note_empty(machine.monotonic);
  const std::int64_t first = machine.monotonic += kMs, first_stamp = machine.stamp();
  machine.monotonic += kMs;
  machine.offset += GetParam();
  const std::int64_t second = machine.monotonic += kMs, second_stamp = machine.stamp();
  machine.monotonic += kMs;
  // Both wait in the socket, stamped before and after the step; the step is seen when the first is read.
  const auto a = clock.arrival(first_stamp, machine.read());
  machine.monotonic += 1000;
  const auto b = clock.arrival(second_stamp, machine.read());
  EXPECT_TRUE(a.is_known);
  EXPECT_EQ(a.time_ns, first);
  EXPECT_TRUE(b.is_known);
  EXPECT_EQ(b.time_ns, second);

  clock.note_empty(machine.monotonic);
  const std::int64_t third = machine.monotonic += kMs, third_stamp = machine.stamp();
  machine.monotonic += 40 * kMs;
  const auto c = clock.arrival(third_stamp, machine.read());
  EXPECT_TRUE(c.is_known);
  EXPECT_EQ(c.time_ns, third);
}

INSTANTIATE_TEST_SUITE_P(Both, Stepped,
                         testing::Values(-300 * kSecond, -kSecond, -10 * kMs, 10 * kMs, kSecond, 300 * kSecond,
                                         1'000'000'000 * kSecond));

TEST(ArrivalClock, DoesNotGuessWhatASmallStepLeavesOpen) {
  Machine machine;
  ArrivalClock clock(machine.read());
  machine.monotonic += 10 * kMs;
  const std::int64_t stamp = machine.stamp();
  machine.offset += 3 * kMs;
  machine.monotonic += 20 * kMs;
  // It arrived 20 ms ago or, had the clock been stepped before, 23 ms ago: it may have been either.
  const auto arrival = clock.arrival(stamp, machine.read());
  EXPECT_FALSE(arrival.is_known);
  EXPECT_EQ(arrival.time_ns, machine.monotonic);
}

TEST(ArrivalClock, DoesNotBelieveAStampFromAnotherAge) {
  Machine machine;
  ArrivalClock clock(machine.read());
  machine.monotonic += kSecond;
  for (const std::int64_t stamp : {std::int64_t{0}, machine.stamp() + kSecond, machine.stamp() - 3 * kSecond}) {
    const auto arrival = clock.arrival(stamp, machine.read());
    EXPECT_FALSE(arrival.is_known);
    EXPECT_EQ(arrival.time_ns, machine.monotonic);
  }
}

// However the clock is stepped, though not twice between two looks at it, an arrival that is called known is the true
// one to within what the clocks can be read.
TEST(ArrivalClock, IsNeverWrongWithoutSayingSo) {
  int known = 0, unknown = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937_64 random(seed);
    const auto up_to = [&](std::int64_t most) {
      return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(most));
    };
    Machine machine;
    ArrivalClock clock(machine.read());
    struct Waiting {
      std::int64_t arrived, stamp;
    };
    std::deque<Waiting> socket;
    bool was_read = true;
    for (int event = 0; event < 2000; ++event) {
      machine.monotonic += 1 + up_to(seed % 2 == 0 ? 2 * kMs : 50'000);
      switch (random() % 8) {
        case 0:
          if (was_read && up_to(20) == 0) {
            was_read = false;
            machine.offset += (up_to(2) == 0 ? -1 : 1) * (std::int64_t{1} << up_to(40));
          }
          break;
        case 1:
        case 2:
        case 3:
          socket.push_back({machine.monotonic, machine.stamp()});
          break;
        default:
          if (socket.empty()) {
            clock.note_empty(machine.monotonic);
          } else {
            const auto arrival = clock.arrival(socket.front().stamp, machine.read());
            was_read = true;
            (arrival.is_known ? known : unknown) += 1;
            if (arrival.is_known) {
              EXPECT_LE(std::abs(arrival.time_ns - socket.front().arrived), 2'000) << seed << " " << event;
            } else {
              EXPECT_EQ(arrival.time_ns, machine.monotonic);
            }
            socket.pop_front();
          }
      }
    }
  }
  EXPECT_GT(known, 10 * unknown);
}

TEST(ArrivalClock, ReadsBothClocksOfThisMachineTogether) {
  const ClockReading a = read_clocks(), b = read_clocks();
  EXPECT_LE(a.monotonic_ns, b.monotonic_ns);
  EXPECT_GE(a.width_ns, 0);
  EXPECT_GT(a.realtime_ns, 1'500'000'000 * kSecond);
}

}  // namespace
}  // namespace farfeel::transport
