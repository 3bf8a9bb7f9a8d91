// Two sessions side by side that differ in one thing: in one of them somebody between the ends adds copies of every
// datagram with bytes changed, cut off and put on, each ahead of the true one. Nothing else may differ: what was
// believed, when, how often, from where.

#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "tests/unit/transport/simulated_session.h"
#include "transport/seal/macs.h"

namespace farfeel::transport {
namespace {

/// All that a session's ends have believed so far.
auto believed(const SimulatedSession& s) {
  const auto& shakes = s.server->handshakes();
  const auto lane = [](const SealedLane& l) {
    const LaneCounters c = l.counters();
    return std::tuple(c.sent, c.received, c.lost, c.late, c.duplicate, l.newest_generation(), l.sending_generation());
  };
  return std::tuple(
      std::tuple(s.poses, s.answers, s.answers_back, s.newest_answer, s.answered_ns, s.statuses, s.next_pose),
      std::tuple(s.server->session().has_value(), s.server->counters().sessions, s.server->bulk_address(),
                 s.server->may_send_bulk(), shakes.welcomed, shakes.busy, shakes.unknown, shakes.expired),
      std::tuple(s.slave_path.address(), s.slave_path.moves(), s.slave_path.is_proven()),
      std::tuple(s.client->counters().sessions, s.client->session() != 0, s.client->has_offered_scene(),
                 s.client->bulk_heard_ns(), s.client->bulk_greeting().handshakes(),
                 s.client->haptic_greeting().handshakes(), s.client->bulk_greeting().suite()),
      lane(s.master_haptic), lane(s.slave_haptic));
}

/// The copies of one datagram. Every byte of the first two of a kind; of later ones some.
class Mutator {
 public:
  template <typename Send>
  void mutate(int way, std::span<const std::byte> d, const Send& send) {
    if (d.empty()) return;
    const bool is_thorough = ++seen_[{way, std::to_integer<int>(d[0]), d.size()}] <= 2;
    if (is_thorough) kinds.insert({way, std::to_integer<int>(d[0]), d.size()});
    std::vector<std::byte> bent(d.begin(), d.end());
    const auto send_bent = [&](std::size_t at, std::byte flip) {
      // Who is not under load does not look at mac2: that is the true one.
      if (d[0] == std::byte{1} && at >= d.size() - kMacBytes) return;
      bent[at] ^= flip;
      send(bent);
      ++copies;
      bent[at] ^= flip;
    };
    if (!is_thorough) {
      for (int i = 0; i < 3; ++i) send_bent(random_() % d.size(), static_cast<std::byte>(1 + random_() % 255));
      return;
    }
    for (std::size_t at = 0; at < d.size(); ++at) {
      for (const int flip : {0x01, 0x80, 0xFF}) send_bent(at, static_cast<std::byte>(flip));
    }
    for (std::size_t size = 0; size < d.size(); ++size) send(d.first(size));
    bent.push_back(std::byte{0});
    send(bent);
  }
  std::set<std::tuple<int, int, std::size_t>> kinds;  // way, first byte, size
  std::uint64_t copies = 0;

 private:
  std::map<std::tuple<int, int, std::size_t>, int> seen_;
  std::mt19937 random_{1};
};

struct Twins {
  Twins() {
    const auto bend = [&](int way, SimulatedNetwork& network, SimulatedNetwork::Direction direction) {
      return [this, way, &network, direction](std::span<const std::byte> d) {
        mutator.mutate(way, d, [&](std::span<const std::byte> copy) { network.send(direction, copy); });
      };
    };
    bent.to_slave = [=, this, forward = bent.to_slave](LaneKind lane, std::span<const std::byte> d) {
      bend(lane == LaneKind::kBulk ? 1 : 0, bent.networks[static_cast<std::size_t>(lane)], SimulatedNetwork::kUp)(d);
      forward(lane, d);
    };
    bent.to_master = [=, this, forward = bent.to_master](const Address& to, std::span<const std::byte> d) {
      for (const std::size_t lane : {0u, 1u}) {
        if (to == bent.addresses[lane]) bend(lane == 0 ? 2 : 3, bent.networks[lane], SimulatedNetwork::kDown)(d);
      }
      forward(to, d);
    };
  }
  void run(double seconds) {
    for (SimulatedSession* s : {&straight, &bent}) s->run(seconds);
    ASSERT_EQ(believed(straight), believed(bent));
  }
  template <typename Do>
  void both(const Do& act) {
    for (SimulatedSession* s : {&straight, &bent}) act(*s);
  }
  Mutator mutator;
  SimulatedSession straight, bent;
};

/// Initiations of nobody, so many that the slave asks for cookies.
void load(SimulatedSession& s) {
  std::array<std::byte, kInitiationBytes> junk{};
  ByteWriter w(junk);
  w.u8(1), w.u8(kLinkVersion), w.u8(static_cast<std::uint8_t>(Suite::kChaChaPoly)), w.u8(1), w.u32(7);
  write_mac1(mac1_key_of(s.slave_key.public_key), junk);
  for (int i = 0; i < 60; ++i) s.at_slave(loopback().with_port(6000), junk);
}

TEST(SessionMutation, NoChangedByteOfAnyMessageIsBelieved) {
  Twins twins;
  for (int i = 0; i < 100; ++i) {
    twins.both(load);
    twins.run(1e-3);
  }
  twins.run(1);
  ASSERT_TRUE(twins.straight.is_up());
  EXPECT_GT(twins.straight.server->handshakes().cookies, 0u);
  twins.both([](SimulatedSession& s) {
    const std::array<std::byte, 4> status{std::byte{1}};
    s.server->send_message(MessageType::kSlaveStatus, status, s.now(), s.to_master);
    s.addresses = {loopback().with_port(5002), loopback().with_port(5003)};  // challenges, on either lane
  });
  twins.run(0.5);
  ASSERT_EQ(twins.straight.slave_path.moves(), 1u);
  twins.both([](SimulatedSession& s) { s.networks[0].is_cut = s.networks[1].is_cut = true; });
  twins.run(0.2);
  twins.both([](SimulatedSession& s) { s.networks[0].is_cut = s.networks[1].is_cut = false; });
  twins.run(0.5);
  twins.both([](SimulatedSession& s) { s.start_slave(); });
  twins.run(1);
  ASSERT_TRUE(twins.straight.is_up());
  twins.both([](SimulatedSession& s) { s.client->end(s.now(), s.to_slave); });
  twins.run(0.1);
  EXPECT_FALSE(twins.straight.server->session());
  std::set<std::pair<int, int>> types;
  for (const auto& [way, type, size] : twins.mutator.kinds) types.insert({way, type});
  for (const auto& expected : {std::pair{0, 1}, {1, 1}, {2, 2}, {3, 2}, {3, 3}, {0, 4}, {1, 4}, {2, 4}, {3, 4}})
    EXPECT_TRUE(types.contains(expected)) << "way " << expected.first << " has seen no type " << expected.second;
  EXPECT_GT(twins.mutator.copies, 30'000u);
}

// Whoever sees an initiation can be quicker with a denial than the slave with its answer.
TEST(SessionMutation, ForgedDenialsKeepNobodyOut) {
  for (int reason = 0; reason < 256; ++reason) {
    SimulatedSession s;
    s.to_slave = [&, forward = s.to_slave](LaneKind lane, std::span<const std::byte> d) {
      forward(lane, d);
      if (d[0] != std::byte{1}) return;
      std::array<std::byte, kDenialBytes> denial;
      write_denial({kLinkVersion, static_cast<DenialReason>(reason), ByteReader(d.subspan(4)).u32()}, denial);
      s.networks[static_cast<std::size_t>(lane)].send(SimulatedNetwork::kDown, denial);
    };
    s.networks[0].is_cut = s.networks[1].is_cut = false;
    EXPECT_LT(s.seconds_until_up(10), 2) << "reason " << reason;
    s.run(0.2);
    EXPECT_TRUE(s.is_up()) << "reason " << reason;
  }
}

}  // namespace
}  // namespace farfeel::transport
