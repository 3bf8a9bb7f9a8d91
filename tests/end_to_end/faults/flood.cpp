#include "tests/end_to_end/faults/flood.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/udp.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <stdexcept>

#include "master_station/session/master_session.h"
#include "tests/end_to_end/faults/processes.h"
#include "tests/end_to_end/faults/remote_world.h"
#include "tests/end_to_end/faults/yardstick.h"
#include "tests/support/quantile.h"
#include "transport/bytes/byte_cursor.h"
#include "transport/net/udp_socket.h"
#include "transport/seal/macs.h"

namespace farfeel::end_to_end {
namespace {

using support::quantile;

constexpr std::size_t kJunk = 1024, kAtOnce = 64;
constexpr std::int64_t kMostDebt_ns = 20'000'000;  // what a flood that was kept from running makes up for
// The flood's place changes with every block, in the order 0 1 1 0: what else this machine does meets both alike, and
// the median over many short blocks is not that of a few that were disturbed.
constexpr std::int64_t kBlock_ns = 250'000'000, kSettles_ns = 20'000'000;
constexpr std::size_t kFewest = 100;  // answers of a block whose 99 % mean anything
// A machine that stood still for longer adds that to the trips under way then, and the flood, and the hand, make up for
// it afterwards: such trips tell of the machine alone.
constexpr std::int64_t kStoodStill_ns = 1'000'000;

bool is_elsewhere(std::int64_t time_ns) {
  const std::int64_t at = time_ns / kBlock_ns % 4;
  return at == 1 || at == 2;
}

struct FloodCount {
  std::array<std::uint64_t, 2> sent{};  // to the slave's door, elsewhere
};

void sleep_until(std::int64_t due_ns) {
  const timespec due{due_ns / 1'000'000'000, due_ns % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr);
}

/// Initiations of nobody. Every other one has a right first mac.
std::vector<std::array<std::byte, transport::kInitiationBytes>> junk() {
  std::mt19937 random(1);
  const transport::Key32 mac1_key = transport::mac1_key_of(slave_key().public_key);
  std::vector<std::array<std::byte, transport::kInitiationBytes>> all(kJunk);
  for (std::size_t i = 0; i < kJunk; ++i) {
    for (std::byte& b : all[i]) b = static_cast<std::byte>(random());
    transport::ByteWriter w(all[i]);
    w.u8(static_cast<std::uint8_t>(transport::DatagramType::kInitiation));
    w.u8(transport::kLinkVersion);
    w.u8(static_cast<std::uint8_t>(transport::Suite::kChaChaPoly));
    w.u8(static_cast<std::uint8_t>(i % 4 < 2 ? transport::LaneKind::kHaptic : transport::LaneKind::kBulk));
    if (i % 2 == 0) transport::write_mac1(mac1_key, all[i]);
  }
  return all;
}

/// A hand's poses until then; answered(now, the round trip that an answer told of [us]).
template <typename Answered>
void hand_poses(master_station::MasterSession& session, std::int64_t until_ns, const Answered& answered) {
  contact::ContactSet newest;
  static std::uint32_t sequence = 0;
  for (std::int64_t due_ns = transport::monotonic_ns(); due_ns < until_ns; due_ns += 1'000'000) {
    sleep_until(due_ns);
    const std::int64_t now_ns = transport::monotonic_ns();
    if (session.remote().poll(newest)) answered(now_ns, 1e3 * session.remote().newest_round_trip_ms());
    master_station::ToolState state;
    state.sequence = ++sequence;
    state.time_ns = now_ns;
    state.X_WT.p = {0, 0, level_m(0) - 1e-3};
    session.remote().send(state);
    due_ns = std::max(due_ns, now_ns - 10'000'000);
  }
}

}  // namespace

void pour(std::uint16_t door, std::uint16_t elsewhere, double per_s, int tell) {
  std::array<int, 2> sockets{};
  for (std::size_t i = 0; i < 2; ++i) {
    sockets[i] = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(i == 0 ? door : elsewhere);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    // The kernel cuts one send into datagrams, so that the flood costs its sender less than those who are flooded.
    constexpr int kCutAt = transport::kInitiationBytes;
    if (connect(sockets[i], reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 ||
        setsockopt(sockets[i], SOL_UDP, UDP_SEGMENT, &kCutAt, sizeof kCutAt) != 0)
      std::_Exit(1);
  }
  const auto datagrams = junk();
  FloodCount count;
  std::size_t at = 0;
  std::int64_t told_ns = transport::monotonic_ns();
  const auto pause_ns = static_cast<std::int64_t>(1e9 * kAtOnce / per_s);
  for (std::int64_t due_ns = told_ns;; due_ns += pause_ns) {
    std::int64_t now_ns = transport::monotonic_ns();
    if (now_ns < due_ns) {
      sleep_until(due_ns);
      now_ns = transport::monotonic_ns();
    }
    due_ns = std::max(due_ns, now_ns - kMostDebt_ns);
    const std::size_t where = is_elsewhere(now_ns) ? 1 : 0;
    if (send(sockets[where], datagrams[at].data(), kAtOnce * transport::kInitiationBytes, 0) > 0)
      count.sent[where] += kAtOnce;
    at = (at + kAtOnce) % kJunk;
    if (now_ns - told_ns > 50'000'000) {
      told_ns = now_ns;
      if (write(tell, &count, sizeof count) != sizeof count) std::_Exit(0);
    }
  }
}

FloodResult measure_flood(const std::string& program, int blocks, double per_s) {
  const Calm calm;
  const OtherProcess slave(program, {"slave", "--no-edits"});
  const auto port = slave.hear<std::uint16_t>();
  if (!port) throw std::runtime_error("the slave did not start");
  // Somebody else's port of the same host: bound, so that the kernel has as much to do, and never read.
  auto elsewhere = transport::UdpSocket::open(transport::loopback()).value();
  transport::Greeter greeter;
  greeter.own = operator_key();
  greeter.slave = slave_key().public_key;
  greeter.master = transport::random_identity();
  greeter.wall_clock_ns = transport::wall_clock_ns;
  greeter.next_counter = [last = std::uint64_t{0}]() mutable {
    return last = std::max(last + 1, static_cast<std::uint64_t>(transport::wall_clock_ns()));
  };
  auto session = master_station::MasterSession::connect({{transport::loopback().with_port(*port)}, greeter, 20, {}});
  if (!session) throw std::runtime_error("no session: " + session.error().message);
  hand_poses(**session, transport::monotonic_ns() + 500'000'000, [](std::int64_t, double) {});

  const OtherProcess flood(program, {"flood", "--port", std::to_string(*port), "--elsewhere",
                                     std::to_string(elsewhere.local().port), "--rate", std::to_string(per_s)});
  if (!flood.hear<FloodCount>()) throw std::runtime_error("there is no flood: the kernel cuts no sends into datagrams");
  FloodCount count;
  Yardstick yardstick;
  std::vector<std::pair<std::int64_t, double>> answers;  // when they came, and their trips [us]
  answers.reserve(static_cast<std::size_t>(2 * blocks * (kBlock_ns / 1'000'000)));
  const std::int64_t began_ns = transport::monotonic_ns();
  hand_poses(**session, began_ns + 2 * blocks * kBlock_ns,
             [&](std::int64_t now_ns, double trip_us) { answers.emplace_back(now_ns, trip_us); });
  while (const auto more = flood.hear<FloodCount>(0.001)) count = *more;
  FloodResult result;
  const double seconds_each = 0.5e-9 * static_cast<double>(transport::monotonic_ns() - began_ns);
  result.per_s = static_cast<double>(count.sent[0]) / seconds_each;
  result.per_s_elsewhere = static_cast<double>(count.sent[1]) / seconds_each;
  std::map<std::int64_t, std::vector<double>> trips_us;  // of each block, by its number
  const std::vector<Stall> stalls = yardstick.comes_first() ? yardstick.stalls(kStoodStill_ns) : std::vector<Stall>{};
  for (const auto& [now_ns, trip_us] : answers) {
    const auto sent_ns = now_ns - static_cast<std::int64_t>(1e3 * trip_us);
    const bool is_shaken = std::any_of(stalls.begin(), stalls.end(), [&](const Stall& stall) {
      return stall.due_ns <= now_ns && stall.woke_ns + kMostDebt_ns >= sent_ns;
    });
    result.shaken += is_shaken ? 1 : 0;
    if (!is_shaken && now_ns % kBlock_ns > kSettles_ns) trips_us[now_ns / kBlock_ns].push_back(trip_us);
  }
  std::array<std::vector<double>, 2> p50s, p99s;  // at the slave's door, elsewhere
  for (auto& [number, trips] : trips_us) {
    const std::size_t where = is_elsewhere(number * kBlock_ns) ? 1 : 0;
    result.answers += trips.size();
    if (trips.size() < kFewest) continue;
    p50s[where].push_back(quantile(trips, 0.5));
    p99s[where].push_back(quantile(trips, 0.99));
  }
  if (p99s[0].empty() || p99s[1].empty()) throw std::runtime_error("hardly an answer came under the flood");
  result.p50_us = quantile(p50s[0], 0.5), result.p50_elsewhere_us = quantile(p50s[1], 0.5);
  result.p99_us = quantile(p99s[0], 0.5), result.p99_elsewhere_us = quantile(p99s[1], 0.5);
  return result;
}

}  // namespace farfeel::end_to_end
