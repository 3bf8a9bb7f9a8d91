#include "tests/bench/link_turn.h"

#include <sched.h>

#include <array>
#include <atomic>
#include <cstring>
#include <thread>

#include "haptic_core/realtime/periodic_loop.h"

namespace farfeel::bench {
namespace {

using realtime::monotonic_now_ns;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::int64_t kSpin_ns = 60'000;       // before a message is to be sent
constexpr std::int64_t kEarly_ns = 150'000;     // the slave is awake before the next one, though it wakes late
constexpr std::int64_t kLateSpin_ns = 400'000;  // after it; who spins all the time meets the real-time throttle
constexpr std::int64_t kNap_ns = 2'000'000;     // asleep without a message, before looking whether the turn is over
constexpr int kFifoPriority = 40;
constexpr int kUncounted = 20;  // round trips, while threads and caches warm up
constexpr std::size_t kMostBytes = 1'500;

using Buffer = std::array<std::byte, kMostBytes>;

std::uint64_t number_of(const Buffer& buffer) {
  std::uint64_t number = 0;
  std::memcpy(&number, buffer.data(), sizeof number);
  return number;
}

/// A core for each end, where there are two: else both may spin on one.
void take_core(int number) {
  cpu_set_t allowed, own;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0 || CPU_COUNT(&allowed) < 2) return;
  CPU_ZERO(&own);
  for (int core = 0, seen = 0; core < CPU_SETSIZE; ++core)
    if (CPU_ISSET(core, &allowed) && seen++ == number) CPU_SET(core, &own);
  (void)sched_setaffinity(0, sizeof own, &own);
}

void answer_all(LinkEnd& slave, const Turn& turn, const std::atomic<bool>& is_over) {
  Buffer asked, answer{};
  std::int64_t due_ns = 0;  // the next message; 0: unknown
  while (!is_over.load(std::memory_order_relaxed)) {
    if (due_ns != 0) realtime::wait_until(due_ns - kEarly_ns, 0);
    std::size_t size = 0;
    while (size == 0 && monotonic_now_ns() < due_ns + kLateSpin_ns) size = slave.receive(asked);
    if (size == 0) {
      slave.wait_until(monotonic_now_ns() + kNap_ns);
      size = slave.receive(asked);
    }
    if (size == 0) continue;
    std::memcpy(answer.data(), asked.data(), sizeof(std::uint64_t));
    (void)slave.send(std::span(answer).first(turn.down_bytes));
    // Its number is when it was sent: who was late once is in time for the next.
    due_ns = static_cast<std::int64_t>(number_of(asked)) + kPeriod_ns;
  }
}

TurnResult ask_all(LinkEnd& master, const Turn& turn) {
  TurnResult result;
  result.rtt_us.reserve(static_cast<std::size_t>(turn.round_trips));
  Buffer asked{}, answer;
  realtime::Deadlines deadlines(monotonic_now_ns() + kPeriod_ns, kPeriod_ns);
  for (int i = 0; i < kUncounted + turn.round_trips; ++i) {
    const std::int64_t begin_ns = realtime::wait_until(deadlines.current_ns(), kSpin_ns);
    const auto number = static_cast<std::uint64_t>(begin_ns);
    std::memcpy(asked.data(), &number, sizeof number);
    (void)master.send(std::span(asked).first(turn.up_bytes));
    bool is_answered = false;
    std::int64_t now_ns = begin_ns;
    while (!is_answered && now_ns < begin_ns + TurnResult::kGiveUp_ns) {
      if (now_ns > begin_ns + kLateSpin_ns) master.wait_until(now_ns + kNap_ns);
      const std::size_t size = master.receive(answer);
      now_ns = monotonic_now_ns();
      is_answered = size == turn.down_bytes && number_of(answer) == number;
    }
    deadlines.advance(now_ns);
    if (i < kUncounted) continue;
    if (is_answered)
      result.rtt_us.push_back(1e-3 * static_cast<double>(now_ns - begin_ns));
    else
      ++result.lost;
  }
  return result;
}

}  // namespace

TurnResult run_turn(LinkMethod& method, const Turn& turn) {
  method.begin_turn();
  std::atomic<bool> is_over{false};
  TurnResult result;
  bool is_slave_fifo = false, is_master_fifo = false;
  std::thread slave([&] {
    take_core(1);
    is_slave_fifo = realtime::use_fifo(kFifoPriority);
    answer_all(method.slave(), turn, is_over);
  });
  std::thread master([&] {
    take_core(0);
    is_master_fifo = realtime::use_fifo(kFifoPriority);
    result = ask_all(method.master(), turn);
  });
  master.join();
  is_over.store(true);
  slave.join();
  result.is_fifo = is_slave_fifo && is_master_fifo;
  return result;
}

}  // namespace farfeel::bench
