#include "tests/end_to_end/faults/simulated.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <random>

#include "tests/unit/transport/simulated_session.h"
#include "transport/lane/sealed_lane.h"

namespace farfeel::end_to_end {
namespace {

using transport::SealedLane;

constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();
constexpr std::size_t kMostWords = 20;

void complain(SimulatedResult& result, const std::string& what) {
  if (result.violations.size() < kMostWords) result.violations.push_back(what);
}

/// That no counter comes twice with a key. Keys are known by the index that their datagrams bear, which is random.
class Nonces {
 public:
  /// Of everything that one end sends, in that order.
  [[nodiscard]] bool is_new(std::span<const std::byte> datagram) {
    const std::uint32_t index = transport::receiver_index(datagram);
    if (index == 0) return true;
    const std::uint64_t counter = transport::ByteReader(datagram.subspan(8)).u64();
    const auto [at, is_first] = last_.try_emplace(index, counter);
    if (is_first) return true;
    const bool is_greater = counter > at->second;
    at->second = counter;
    return is_greater;
  }

 private:
  std::map<std::uint32_t, std::uint64_t> last_;
};

/// What one datagram of carry() needs.
struct Small {
  std::array<std::byte, sizeof(std::uint64_t) + transport::kSealBytes> bytes;
};

/// When copies of a datagram arrive, in steps from now: none, one or two. Some come far behind the window.
class RoughRoad {
 public:
  static constexpr std::size_t kMostSteps = 4096;
  explicit RoughRoad(std::uint64_t seed) : random_(seed), under_way_(kMostSteps) {}
  void send(const Small& datagram) {
    const std::uint64_t dice = random_();
    if (dice % 50 == 0) return;  // lost
    for (int copies = dice % 20 == 1 ? 2 : 1; copies > 0; --copies) {
      std::size_t steps = 1;
      const std::uint64_t fate = random_() % 1000;
      if (fate < 100) steps += random_() % 30;
      if (fate < 3) steps += random_() % (kMostSteps - 31);
      under_way_[(now_ + steps) % kMostSteps].push_back(datagram);
    }
  }
  template <typename Arrive>
  void step(const Arrive& arrive) {
    now_ = (now_ + 1) % kMostSteps;
    for (Small& datagram : under_way_[now_]) arrive(datagram);
    under_way_[now_].clear();
  }

 private:
  std::mt19937_64 random_;
  std::vector<std::vector<Small>> under_way_;
  std::size_t now_ = 0;
};

/// One way of a lane.
struct Way {
  Way(std::uint64_t packets, std::uint64_t seed) : road(seed), opened(packets) {}
  RoughRoad road;
  std::vector<bool> opened;  // by the number in the message
  std::uint64_t sent = 0, newest = 0;
  Nonces nonces;
};

}  // namespace

SimulatedResult carry(std::uint64_t packets, std::uint64_t seed) {
  constexpr std::int64_t kStep_ns = 500'000;  // poses at 2 kHz
  SimulatedResult result;
  std::mt19937_64 random(seed);
  std::array lanes{SealedLane(SealedLane::Role::kInitiator), SealedLane(SealedLane::Role::kResponder)};
  std::array ways{Way(packets, seed + 1), Way(packets, seed + 2)};  // up, down: from lanes[0], from lanes[1]
  std::int64_t now_ns = 1, made_ns = 0;
  std::uint64_t skipped = 0;  // the newest generation of the responder whose counters are near their end
  const auto shake = [&] {
    transport::LaneKeys keys;
    keys.generation = ++result.handshakes;
    keys.suite =
        transport::is_available(transport::Suite::kAesGcm) ? transport::Suite::kAesGcm : transport::Suite::kChaChaPoly;
    keys.local_index = static_cast<std::uint32_t>(2 * keys.generation);
    keys.remote_index = static_cast<std::uint32_t>(2 * keys.generation + 1);
    for (std::byte& b : keys.send) b = static_cast<std::byte>(random());
    for (std::byte& b : keys.receive) b = static_cast<std::byte>(random());
    keys.made_ns = made_ns = now_ns;
    lanes[0].adopt(keys);
    lanes[0].skip_to(kLast - 1000 - random() % 100'000);
    std::swap(keys.send, keys.receive);
    std::swap(keys.local_index, keys.remote_index);
    lanes[1].adopt(keys);
  };
  shake();
  while (ways[0].sent + ways[1].sent < packets) {
    now_ns += kStep_ns;
    if (now_ns - made_ns > transport::kRekey_ns) shake();
    for (const std::size_t from : {0u, 1u}) {
      Way& way = ways[from];
      SealedLane& receiver = lanes[1 - from];
      if (from == 1 && lanes[1].sending_generation() > skipped) {
        skipped = lanes[1].sending_generation();
        lanes[1].skip_to(kLast - 1000 - random() % 100'000);
      }
      std::array<std::byte, sizeof(std::uint64_t)> message;
      transport::ByteWriter(message).u64(way.sent);
      Small datagram;
      if (lanes[from].seal(16, message, datagram.bytes, now_ns) == 0) {
        if (lanes[from].sending_generation() != 0) {
          ++result.refusals;
          shake();
        }
      } else {
        if (!way.nonces.is_new(datagram.bytes)) complain(result, "a counter came twice with a key");
        ++way.sent;
        way.road.send(datagram);
      }
      way.road.step([&](Small& arrived) {
        const auto opened = receiver.open(arrived.bytes, now_ns);
        if (!opened) return;
        ++result.opened;
        const std::uint64_t number = transport::ByteReader(opened->message).u64();
        if (number >= way.sent) return complain(result, fmt::format("{} was never sent", number));
        if (way.opened[number]) complain(result, fmt::format("{} was opened twice", number));
        way.opened[number] = true;
        if (opened->is_newest && number < way.newest)
          complain(result, fmt::format("{} counts as newer than {}", number, way.newest));
        if (opened->is_newest) way.newest = number;
      });
    }
  }
  result.packets = ways[0].sent + ways[1].sent;
  result.simulated_s = 1e-9 * static_cast<double>(now_ns);
  return result;
}

SimulatedResult live(std::uint64_t packets, std::uint64_t seed) {
  constexpr double kPatience_s = 5;
  SimulatedResult result;
  std::mt19937_64 random(seed);
  transport::SimulatedSession s("rtt=20ms jitter=3ms loss=2%,burst=3 reorder=3% duplicate=3%", seed);
  std::array<Nonces, 2> nonces;  // the master's, the slave's
  s.to_slave = [&, forward = s.to_slave](transport::LaneKind lane, std::span<const std::byte> d) {
    ++result.packets;
    if (!nonces[0].is_new(d)) complain(result, "a counter came twice with a key of the master's");
    forward(lane, d);
  };
  std::array<std::uint64_t, 2> generations{};
  std::uint64_t newest = 0, poses = 0;
  std::int64_t restarted_ns = s.now();
  if (s.seconds_until_up(kPatience_s) >= kPatience_s) complain(result, "the session did not begin");
  while (result.packets < packets && result.violations.size() < kMostWords) {
    s.step();
    for (const auto& datagram : s.sent) {
      ++result.packets;
      if (!nonces[1].is_new(datagram)) complain(result, "a counter came twice with a key of the slave's");
    }
    s.sent.clear();
    s.sent_to.clear();
    s.statuses.clear();
    const std::array lanes{&s.master_haptic, &s.slave_haptic};
    for (const std::size_t end : {0u, 1u}) {
      const std::uint64_t generation = lanes[end]->sending_generation();
      if (generation == 0 || generation == generations[end]) continue;
      generations[end] = generation;
      result.handshakes += end == 0 ? 1 : 0;
      lanes[end]->skip_to(kLast - 1000 - random() % 100'000);
    }
    if (generations[0] != 0 && !s.master_haptic.can_send(s.now())) ++result.refusals;
    if (s.poses > poses) {
      poses = s.poses;
      result.opened = s.poses + s.answers;
      const std::uint64_t pose = transport::ByteReader(s.newest_pose).u64();
      if (pose <= newest) complain(result, fmt::format("the slave takes pose {} after {}", pose, newest));
      newest = pose;
    }
    if (s.answers_back > 0) complain(result, "the master takes an answer to an older pose than one before");
    if (s.now() - restarted_ns > 100'000'000'000 + static_cast<std::int64_t>(random() % 100'000'000'000)) {
      s.start_slave();
      restarted_ns = s.now();
      generations = {};
    }
    if (s.now() - std::max(s.answered_ns, restarted_ns) > static_cast<std::int64_t>(1e9 * kPatience_s)) {
      complain(result, fmt::format("no answer for {} s, {} s after the start", kPatience_s,
                                   1e-9 * static_cast<double>(s.now())));
      break;
    }
  }
  result.simulated_s = 1e-9 * static_cast<double>(s.now());
  return result;
}

}  // namespace farfeel::end_to_end
