// Both ends of a session against each other, both lanes, in simulated time.

#include <gtest/gtest.h>

#include "tests/unit/transport/simulated_session.h"

namespace farfeel::transport {
namespace {

TEST(SessionProtocol, GreetsAndTakesTheScene) {
  SimulatedSession world;
  EXPECT_LT(world.seconds_until_up(5), 0.5);
  EXPECT_EQ(world.scene_here(), world.object->bytes);
  EXPECT_EQ(world.client->trouble(world.now()), "");
  EXPECT_EQ(world.server->session()->operator_name, "anna");
}

TEST(SessionProtocol, ComesUpOverBadLinksAndStaysUp) {
  for (const char* link : {"rtt=400ms", "rtt=100ms jitter=50ms loss=20%,burst=4 reorder=5% duplicate=10%",
                           "rtt=600ms duplicate=100%", "rtt=0ms loss=50%"}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SimulatedSession world(link, seed);
      EXPECT_LT(world.seconds_until_up(30), 30) << link << seed;
      world.run(5);
      EXPECT_TRUE(world.is_bulk_up()) << link << seed;
      EXPECT_EQ(world.client->counters().sessions, 1u) << link << seed;
      EXPECT_EQ(world.answers_back, 0u);
    }
  }
}

TEST(SessionProtocol, StaysUpWithoutAnythingToSayAndRenewsItsKeys) {
  SimulatedSession world;
  world.seconds_until_up(5);
  const std::uint64_t before = world.answers;
  const std::int64_t began = world.now();
  world.run(400);
  EXPECT_TRUE(world.is_up());
  EXPECT_EQ(world.server->counters().sessions, 1u);
  EXPECT_GE(world.client->haptic_greeting().handshakes(), 4u);  // after 0, 120, 240 and 360 s
  EXPECT_LE(world.client->haptic_greeting().handshakes(), 5u);
  // No answer is lost to the changes of keys: one a millisecond.
  EXPECT_GE(static_cast<double>(world.answers - before), 1e-6 * static_cast<double>(world.now() - began) - 1);
}

TEST(SessionProtocol, DoublesThePauseWhileNobodyAnswers) {
  SimulatedSession world;
  world.slave_runs = false;
  world.run(2);
  EXPECT_EQ(world.client->trouble(world.now()), "no answer yet");
  world.run(8);
  // Greetings at 0, 0.25, 0.75, 1.75, 3.75, 5.75, 7.75, 9.75 s.
  EXPECT_EQ(world.client->bulk_greeting().initiations(), 8u);
  EXPECT_NE(world.client->trouble(world.now()).find("UDP does not get through"), std::string::npos);
  world.slave_runs = true;
  EXPECT_LE(world.seconds_until_up(5), 2.2);
}

TEST(SessionProtocol, AnEchoIsToldAsOne) {
  SimulatedSession world;
  SessionClient client(world.greeter);
  std::vector<std::vector<std::byte>> sent;
  const auto send = [&](LaneKind, std::span<const std::byte> datagram) {
    sent.emplace_back(datagram.begin(), datagram.end());
  };
  client.on_time(1, send);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(client.trouble(2), "no answer yet");
  std::vector<std::byte> back = sent[0];
  EXPECT_FALSE(client.on_datagram(back, 2, send));
  EXPECT_NE(client.trouble(2).find("echo service"), std::string::npos) << client.trouble(2);
}

// Back after packets pass again: one round trip while the keys live, two and the pause between two greetings later.
TEST(SessionProtocol, ComesBackInARoundTripWhileItsKeysLive) {
  for (const int rtt_ms : {0, 20, 200}) {
    for (const double outage_s : {0.1, 1.0, 14.0, 100.0}) {
      SimulatedSession world("rtt=" + std::to_string(rtt_ms) + "ms");
      world.seconds_until_up(5);
      for (SimulatedNetwork& network : world.networks) network.is_cut = true;
      world.run(outage_s);
      for (SimulatedNetwork& network : world.networks) network.forget_all(), network.is_cut = false;
      const std::int64_t passes = world.now();
      world.answered_ns = 0;
      const double back_s = world.seconds_until(5, [&] { return world.answered_ns > passes; });
      EXPECT_LE(back_s, 1e-3 * rtt_ms + 0.005) << rtt_ms << " ms, " << outage_s << " s";
      EXPECT_EQ(world.client->counters().sessions, 1u);
    }
  }
}

TEST(SessionProtocol, ComesBackWithNewKeysWhenTheOldAreDead) {
  for (const int rtt_ms : {0, 20, 200}) {
    SimulatedSession world("rtt=" + std::to_string(rtt_ms) + "ms");
    world.seconds_until_up(5);
    for (SimulatedNetwork& network : world.networks) network.is_cut = true;
    world.run(200);
    for (SimulatedNetwork& network : world.networks) network.forget_all(), network.is_cut = false;
    const std::int64_t passes = world.now();
    const double back_s = world.seconds_until(9, [&] { return world.answered_ns > passes; });
    EXPECT_LE(back_s, 3e-3 * rtt_ms + 0.505) << rtt_ms;  // a pause of 0.5 s, a handshake, a pose and its answer
  }
}

// A lane that is cut off does not take the other one with it, and comes back by itself.
TEST(SessionProtocol, LanesLiveAndDieByThemselves) {
  for (const std::size_t lane : {0u, 1u}) {
    SimulatedSession world;
    world.seconds_until_up(5);
    world.networks[lane].is_cut = true;
    world.run(30);
    const std::uint64_t before = world.answers;
    world.run(1);
    if (lane == 1) {
      EXPECT_GE(world.answers - before, 999u);  // the hand feels on
    }
    EXPECT_EQ(world.server->counters().sessions, 1u);
    world.networks[lane].is_cut = false;
    const std::int64_t passes = world.now();
    world.answered_ns = 0;
    EXPECT_LE(world.seconds_until(5, [&] { return world.answered_ns > passes && world.is_bulk_up(); }), 0.03);
    EXPECT_EQ(world.client->counters().sessions, 1u);
  }
}

// An address translator in between gives a lane another address: its next authentic datagram tells, nothing else.
TEST(SessionProtocol, EitherLaneRoams) {
  for (const std::size_t lane : {0u, 1u}) {
    for (const int rtt_ms : {0, 20, 200}) {
      SimulatedSession world("rtt=" + std::to_string(rtt_ms) + "ms");
      world.seconds_until_up(5);
      world.addresses[lane].port = 7000;
      const std::int64_t moved = world.now();
      if (lane == 0) {
        world.answered_ns = 0;
        EXPECT_LE(world.seconds_until(5, [&] { return world.answered_ns > moved; }), 1e-3 * rtt_ms + 0.005);
        world.run(1e-3 * rtt_ms + 0.1);
        EXPECT_EQ(world.slave_path.moves(), 1u);
        EXPECT_TRUE(world.slave_path.is_proven());
      } else {
        EXPECT_LE(world.seconds_until(5, [&] { return world.server->bulk_address() == world.addresses[1]; }),
                  0.5e-3 * rtt_ms + 0.025);  // one way, and the pause of a keep-alive
        world.run(1e-3 * rtt_ms + 0.1);
        EXPECT_TRUE(world.server->may_send_bulk());
      }
      world.run(5);
      EXPECT_TRUE(world.is_up());
      EXPECT_EQ(world.server->counters().sessions, 1u);
    }
  }
}

// Until the address is proven no more goes there than came from there, in sum.
TEST(SessionProtocol, SendsNoMoreToAnUnprovenAddressThanCameFromIt) {
  SimulatedSession world;
  world.seconds_until_up(5);
  // Somebody on the way sends the master's authentic datagrams on from another address, and answers nothing.
  const Address thief = loopback().with_port(9999);
  std::size_t from_thief = 0;
  const auto to_slave = world.to_slave;
  std::vector<std::vector<std::byte>> taken;
  world.to_slave = [&](LaneKind, std::span<const std::byte> d) { taken.emplace_back(d.begin(), d.end()); };
  world.sent.clear(), world.sent_to.clear();
  for (int i = 0; i < 1000; ++i) {
    world.step();
    for (const auto& datagram : taken) {
      world.at_slave(thief, datagram);
      from_thief += datagram.size();
    }
    taken.clear();
    std::size_t to_thief = 0;
    for (std::size_t k = 0; k < world.sent.size(); ++k)
      to_thief += world.sent_to[k] == thief ? world.sent[k].size() : 0;
    ASSERT_LE(to_thief, from_thief);
  }
  EXPECT_FALSE(world.slave_path.is_proven());
  EXPECT_FALSE(world.server->may_send_bulk());
  world.to_slave = to_slave;
  world.run(0.2);
  EXPECT_TRUE(world.is_up());  // the master's own next datagram brings it back
}

TEST(SessionProtocol, AnswersNoStrangerWithMoreThanItSent) {
  SimulatedSession world;
  const Address stranger = loopback().with_port(6000);
  std::vector<std::vector<std::byte>> up;
  const auto to_slave = world.to_slave;
  world.to_slave = [&](LaneKind lane, std::span<const std::byte> d) {
    up.emplace_back(d.begin(), d.end());
    to_slave(lane, d);
  };
  world.seconds_until_up(5);
  world.run(0.2);
  world.to_slave = to_slave;
  world.run(0.1);  // all of those have arrived
  std::mt19937 random(5);
  const std::uint32_t id = world.client->session();
  const auto address = world.server->bulk_address();
  for (int round = 0; round < 4; ++round) {
    for (auto datagram : up) {
      if (round > 0) datagram[random() % datagram.size()] ^= static_cast<std::byte>(1 + random() % 255);
      world.sent.clear();
      world.at_slave(stranger, datagram);
      std::size_t answered = 0;
      for (const auto& answer : world.sent) answered += answer.size();
      EXPECT_LE(answered, datagram.size());
      EXPECT_EQ(world.server->session()->id, id);
      EXPECT_EQ(world.server->bulk_address(), address);
      EXPECT_EQ(world.slave_path.moves(), 0u);
    }
  }
  world.run(3);
  EXPECT_TRUE(world.is_up());
  EXPECT_EQ(world.client->session(), id);
}

TEST(SessionProtocol, ComesBackAtOnceAfterTheSlaveWasRestarted) {
  SimulatedSession world;
  world.seconds_until_up(5);
  const std::uint32_t before = world.client->session();
  const std::uint64_t epoch = world.client->epoch();
  world.start_slave(world.object);  // kill -9 and start again
  world.sent.clear();
  EXPECT_LT(world.seconds_until(5, [&] { return world.client->session() != before && world.is_up(); }), 0.3);
  EXPECT_NE(world.client->epoch(), epoch);
  EXPECT_EQ(world.client->counters().sessions, 2u);
  // The scene is not sent a second time: all that went down was small.
  for (const auto& datagram : world.sent) EXPECT_LT(datagram.size(), 500u);
}

TEST(SessionProtocol, FetchesTheSceneAgainIfItIsAnother) {
  SimulatedSession world;
  world.seconds_until_up(5);
  world.start_slave(some_object(2));
  world.run(0.3);
  world.seconds_until_up(5);
  EXPECT_EQ(world.scene_here(), world.object->bytes);
}

TEST(SessionProtocol, ServesTheRestartedMasterOnceTheOldSessionIsSilent) {
  SimulatedSession world;
  world.seconds_until_up(5);
  world.greeter.master = 78;
  world.start_master();  // kill -9 and start again, from the same port
  world.run(0.5);
  EXPECT_NE(world.client->trouble(world.now()).find("another master"), std::string::npos);
  EXPECT_LE(world.seconds_until_up(10), 4.2);
  EXPECT_EQ(world.server->session()->master, 78u);
}

TEST(SessionProtocol, SaysGoodbye) {
  SimulatedSession world;
  world.seconds_until_up(5);
  world.client->end(world.now(), world.to_slave);
  world.run(0.1);
  EXPECT_FALSE(world.server->session());
  EXPECT_EQ(world.server->last_end(), "the master said goodbye");
  EXPECT_EQ(world.client->session(), 0u);
}

TEST(SessionProtocol, GivesTheNewestStatusOnly) {
  SimulatedSession world("rtt=20ms reorder=30% duplicate=30%");
  world.seconds_until_up(5);
  for (std::uint8_t i = 1; i <= 100; ++i) {
    const std::array<std::byte, 1> status{static_cast<std::byte>(i)};
    world.server->send_message(MessageType::kSlaveStatus, status, world.now(), world.to_master);
    world.run(0.002);
  }
  world.run(0.2);
  ASSERT_GT(world.statuses.size(), 20u);
  EXPECT_TRUE(std::is_sorted(world.statuses.begin(), world.statuses.end()));
  EXPECT_EQ(std::adjacent_find(world.statuses.begin(), world.statuses.end()), world.statuses.end());
}

TEST(SessionProtocol, TellsWhyNobodyIsLetIn) {
  const auto trouble_of = [](const auto& spoil) {
    SimulatedSession world;
    spoil(world);
    world.start_master();
    world.run(2);
    EXPECT_FALSE(world.server->session());
    return world.client->trouble(world.now());
  };
  EXPECT_NE(trouble_of([](SimulatedSession& w) { w.trusted.clear(); }).find("does not know this operator"),
            std::string::npos);
  EXPECT_NE(trouble_of([](SimulatedSession& w) { w.trusted[0].second.is_expired = true; }).find("expired"),
            std::string::npos);
  EXPECT_NE(trouble_of([](SimulatedSession& w) { w.greeter.slave = new_key_pair().public_key; }).find("another key"),
            std::string::npos);
}

TEST(SessionProtocol, ADifferentPskLetsNobodyIn) {
  SimulatedSession world;
  world.trusted[0].second.psk[0] = std::byte{1};
  world.start_master();
  world.run(5);
  EXPECT_FALSE(world.server->session());
  EXPECT_EQ(world.client->session(), 0u);
}

TEST(SessionProtocol, ARevokedOperatorIsOutAtOnce) {
  SimulatedSession world;
  world.seconds_until_up(5);
  world.trusted.clear();
  world.server->on_changed_list(world.now(), world.to_master);
  EXPECT_FALSE(world.server->session());
  world.run(0.1);
  EXPECT_NE(world.client->trouble(world.now()).find("does not trust"), std::string::npos);
  world.run(20);
  EXPECT_FALSE(world.server->session());
}

// Somebody who kept every greeting plays them to the slave, later and after its restart: no session moves or begins.
TEST(SessionProtocol, ReplayedGreetingsChangeNothing) {
  SimulatedSession world;
  std::vector<std::vector<std::byte>> greetings;
  const auto to_slave = world.to_slave;
  world.to_slave = [&](LaneKind lane, std::span<const std::byte> d) {
    if (d[0] == std::byte{1}) greetings.emplace_back(d.begin(), d.end());
    to_slave(lane, d);
  };
  world.seconds_until_up(5);
  world.networks[0].is_cut = true;  // so that the haptic lane greets again and again
  world.run(7);
  world.networks[0].is_cut = false;
  world.seconds_until_up(5);
  ASSERT_GT(greetings.size(), 100u);
  const Address thief = loopback().with_port(9999);
  for (const auto& greeting : greetings) world.at_slave(thief, greeting);
  world.run(3);
  EXPECT_TRUE(world.is_up());
  EXPECT_EQ(world.client->counters().sessions, 1u);
  EXPECT_EQ(world.slave_path.moves(), 0u);
  world.start_slave(world.object);
  for (const auto& greeting : greetings) world.at_slave(thief, greeting);
  EXPECT_FALSE(world.server->session());
  EXPECT_LT(world.seconds_until_up(5), 0.5);
  EXPECT_NE(world.server->bulk_address(), thief);
}

// Each greeting costs 0.2 ms: beyond a hundred a second the sender must show that it gets what is sent to it.
TEST(SessionProtocol, AFloodOfGreetingsIsAnsweredWithCookiesAndOperatorsStillGetIn) {
  SimulatedSession world;
  const auto greeting_of_a_stranger = [&] {
    InitiatorHandshake handshake(Suite::kChaChaPoly, LaneKind::kBulk, 4242, new_key_pair(), world.slave_key.public_key,
                                 kNoPsk);
    std::array<std::byte, kInitiationBytes> greeting;
    EXPECT_TRUE(handshake.write_initiation({1, 1, 1, 0}, greeting));
    return greeting;
  };
  const auto greeting = greeting_of_a_stranger();
  for (int i = 0; i < 3000; ++i) {
    for (int k = 0; k < 10; ++k) world.at_slave(loopback().with_port(static_cast<std::uint16_t>(10'000 + i)), greeting);
    world.step();
  }
  EXPECT_TRUE(world.is_up());
  const auto& counters = world.server->handshakes();
  EXPECT_GT(counters.cookies, 25'000u);
  EXPECT_LT(counters.unknown, 1'000u);  // as far as X25519 came no more than are free, and the operator's
}

}  // namespace
}  // namespace farfeel::transport
