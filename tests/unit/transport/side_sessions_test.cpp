// Those who watch and edit, beside a master, in simulated time.

#include "transport/side_sessions.h"

#include <gtest/gtest.h>

#include "tests/unit/transport/simulated_session.h"

namespace farfeel::transport {
namespace {

/// One process with a key of its own, on a link of its own.
struct Side {
  Side(SimulatedSession& beside, std::uint16_t port, Operator as, const std::string& link = "rtt=20ms",
       SessionClient::Takes takes = SessionClient::Takes::kNothing)
      : world(beside), address(loopback().with_port(port)), network(parse_link_spec(link).value(), port) {
    greeter.own = new_key_pair();
    greeter.slave = world.slave_key.public_key;
    greeter.master = port;
    greeter.next_counter = counting();
    greeter.wall_clock_ns = [this] { return world.now(); };
    world.trusted.push_back({greeter.own.public_key, std::move(as)});
    network.now_ns = world.now();
    begin(takes);
    world.to_master = [this, others = world.to_master](const Address& to, std::span<const std::byte> d) {
      to == address ? network.send(SimulatedNetwork::kDown, d) : others(to, d);
    };
  }
  void begin(SessionClient::Takes takes) { client.emplace(greeter, LaneKind::kSide, takes); }
  void ask(std::uint8_t what, MessageType as = MessageType::kEditRequest) {
    const std::array payload{std::byte{what}};
    client->send_message(as, payload, world.now(), up());
  }
  SessionClient::Send up() {
    return [this](LaneKind, std::span<const std::byte> d) { network.send(SimulatedNetwork::kUp, d); };
  }
  void step() {
    network.now_ns = world.now();
    network.deliver(SimulatedNetwork::kUp, [&](std::span<const std::byte> d) {
      std::vector<std::byte> bytes(d.begin(), d.end());
      const auto outcome = world.server->on_datagram(address, bytes, world.now(), world.now(), world.to_master);
      if (outcome.side && outcome.side->message) asked.push_back(outcome.side->message->payload[0]);
    });
    network.deliver(SimulatedNetwork::kDown, [&](std::span<const std::byte> d) {
      std::vector<std::byte> bytes(d.begin(), d.end());
      const auto message = client->on_datagram(bytes, world.now(), up());
      if (message && message->type == MessageType::kEditAnswer) ++answers;
    });
    if (is_running) client->on_time(world.now(), up());
  }

  SimulatedSession& world;
  Address address;
  SimulatedNetwork network;
  Greeter greeter;
  std::optional<SessionClient> client;
  std::vector<std::byte> asked;  ///< at the slave
  int answers = 0;
  bool is_running = true;
};

constexpr double kPatience_s = 5;
Operator watcher() {
  return {"walter", {}, false, false, true, false};
}
Operator editor() {
  return {"edith", {}, false, false, true, true};
}

template <typename Condition>
double seconds_until(SimulatedSession& world, std::span<Side* const> sides, const Condition& is_so,
                     double limit_s = kPatience_s) {
  const std::int64_t began = world.now();
  while (!is_so() && world.now() - began < static_cast<std::int64_t>(limit_s * 1e9)) {
    world.step();
    for (Side* side : sides) side->step();
  }
  return 1e-9 * static_cast<double>(world.now() - began);
}
void run(SimulatedSession& world, std::span<Side* const> sides, double seconds) {
  (void)seconds_until(
      world, sides, [] { return false; }, seconds);
}

TEST(SideSessions, WatchesAndEditsBesideAMaster) {
  SimulatedSession world;
  Side watching(world, 6000, watcher(), "rtt=20ms", SessionClient::Takes::kScene), editing(world, 6001, editor());
  Side* const all[]{&watching, &editing};
  EXPECT_LT(seconds_until(world, all,
                          [&] {
                            return world.is_up() && watching.client->has_offered_scene() &&
                                   editing.client->is_heard(world.now());
                          }),
            1);
  editing.ask(7);
  watching.ask(8);
  run(world, all, 0.5);
  EXPECT_EQ(editing.asked, std::vector{std::byte{7}});
  EXPECT_TRUE(watching.asked.empty()) << "who may watch alone edits nothing";
  EXPECT_FALSE(editing.client->has_offered_scene()) << "it did not want it";
  for (std::size_t i = 0; i < 2; ++i)
    world.server->sides().send(i, MessageType::kEditAnswer, {}, world.now(), world.to_master);
  run(world, all, 0.5);
  EXPECT_EQ(watching.answers, 1);
  EXPECT_EQ(editing.answers, 1);
  EXPECT_TRUE(world.is_up());
  EXPECT_EQ(world.client->counters().sessions, 1u);
}

TEST(SideSessions, WhoMayWatchAsksForTheSceneAsFiles) {
  SimulatedSession world;
  Side saving(world, 6000, watcher(), "rtt=40ms loss=10%", SessionClient::Takes::kSaved);
  Side watching(world, 6001, watcher(), "rtt=20ms", SessionClient::Takes::kScene);
  Side* const all[]{&saving, &watching};
  EXPECT_LT(seconds_until(world, all, [&] { return saving.client->is_heard(world.now()); }), 3);
  for (int i = 0; i < 10; ++i) saving.ask(9, MessageType::kSaveRequest);  // some are lost
  run(world, all, 0.5);
  ASSERT_FALSE(saving.asked.empty());
  EXPECT_EQ(saving.asked.front(), std::byte{9});
  const auto files = make_object(std::vector<std::byte>(100'000, std::byte{5}));
  for (std::size_t i = 0; i < 2; ++i)
    world.server->sides().bulk(i).outbox().offer(kSavedSlot, files, kSceneUrgency, world.now());
  EXPECT_LT(seconds_until(world, all, [&] { return saving.client->saved().has_value(); }), kPatience_s);
  EXPECT_EQ(saving.client->saved()->hash, files->hash);
  EXPECT_FALSE(saving.client->scene()) << "the scene was not wanted";
  run(world, all, 0.5);
  EXPECT_TRUE(watching.client->has_offered_scene());
  EXPECT_FALSE(watching.client->saved()) << "nobody asked for it there";
}

TEST(SideSessions, WithoutARoleNobodyComesAndNobodyOperates) {
  SimulatedSession world;
  Side hand(world, 6000, {"hanna", {}, false});
  world.trusted[0].second.may_operate = false;  // anna's, who would be the master
  Side* const all[]{&hand};
  run(world, all, 2);
  EXPECT_FALSE(world.is_bulk_up());
  EXPECT_NE(world.client->trouble(world.now()).find("--role operate'"), std::string::npos);
  EXPECT_FALSE(hand.client->is_heard(world.now()));
  EXPECT_NE(hand.client->trouble(world.now()).find("--role operate,edit'"), std::string::npos);
}

TEST(SideSessions, PlacesAreBoundedByKeyAndInAll) {
  SimulatedSession world;
  std::vector<std::unique_ptr<Side>> sides;
  std::vector<Side*> all;
  for (std::uint16_t i = 0; i < 9; ++i) {
    sides.push_back(std::make_unique<Side>(world, static_cast<std::uint16_t>(6000 + i), watcher()));
    all.push_back(sides.back().get());
  }
  const auto live = [&] {
    int count = 0;
    for (Side* side : all) count += side->client->is_heard(world.now()) ? 1 : 0;
    return count;
  };
  run(world, all, 2);
  EXPECT_EQ(live(), 8);
  // One that falls silent gives way to the ninth.
  for (Side* side : all) {
    if (!side->client->is_heard(world.now())) continue;
    side->is_running = false;
    break;
  }
  EXPECT_LT(seconds_until(world, all, [&] { return live() == 8; }), 4.5);
  EXPECT_TRUE(world.is_up());

  SimulatedSession other;
  std::vector<std::unique_ptr<Side>> ones;
  all.clear();
  for (std::uint16_t i = 0; i < 5; ++i) {
    ones.push_back(std::make_unique<Side>(other, static_cast<std::uint16_t>(6000 + i), watcher()));
    if (i > 0)
      ones[i]->greeter.own = ones[0]->greeter.own, ones[i]->greeter.next_counter = ones[0]->greeter.next_counter;
    ones[i]->begin(SessionClient::Takes::kNothing);
    all.push_back(ones[i].get());
  }
  run(other, all, 2);
  int of_one_key = 0;
  for (Side* side : all) of_one_key += side->client->is_heard(other.now()) ? 1 : 0;
  EXPECT_EQ(of_one_key, 4);
}

TEST(SideSessions, ComesUpOverABadLinkAndStaysUpWithNewKeys) {
  SimulatedSession world;
  Side side(world, 6000, editor(), "rtt=100ms jitter=30ms loss=20%,burst=4 duplicate=10%",
            SessionClient::Takes::kScene);
  Side* const all[]{&side};
  EXPECT_LT(seconds_until(
                world, all, [&] { return side.client->has_offered_scene(); }, 20),
            20);
  run(world, all, 150);  // beyond the keys' age
  EXPECT_TRUE(side.client->is_heard(world.now()));
  EXPECT_EQ(side.client->counters().sessions, 1u);
}

TEST(SideSessions, WhoLosesTheRightIsOut) {
  SimulatedSession world;
  Side side(world, 6000, editor());
  Side* const all[]{&side};
  seconds_until(world, all, [&] { return side.client->is_heard(world.now()); });
  world.trusted.back().second.may_edit = false;
  world.server->on_changed_list(world.now(), world.to_master);
  side.ask(1);
  run(world, all, 0.2);
  EXPECT_TRUE(side.client->is_heard(world.now())) << "it may watch still";
  EXPECT_TRUE(side.asked.empty());
  world.trusted.back().second.may_watch = false;
  world.server->on_changed_list(world.now(), world.to_master);
  run(world, all, 0.2);
  EXPECT_FALSE(side.client->is_heard(world.now()));
  EXPECT_NE(side.client->trouble(world.now()).find("does not trust this operator's key any more"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::transport
