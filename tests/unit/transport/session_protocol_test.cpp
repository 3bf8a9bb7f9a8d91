// The two state machines of the bulk lane against each other, in simulated time.

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/transport/simulated_network.h"
#include "transport/session_client.h"
#include "transport/session_server.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kStep_ns = 1'000'000;

std::shared_ptr<const Object> scene(unsigned seed = 1) {
  std::mt19937 random(seed);
  std::vector<std::byte> bytes(50'000);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random());
  return make_object(std::move(bytes));
}

/// A slave, and a master at address 127.0.0.1:5000, with a network between them.
struct World {
  explicit World(const std::string& link = "rtt=20ms", std::uint64_t seed = 1)
      : network(parse_link_spec(link).value(), seed) {
    master_address.port = 5000;
    to_master = [this](const Address& to, std::span<const std::byte> d) {
      if (to == master_address) network.send(SimulatedNetwork::kDown, d);
      sent_to.push_back(to);
      sent.emplace_back(d.begin(), d.end());
    };
    to_slave = [this](std::span<const std::byte> d) { network.send(SimulatedNetwork::kUp, d); };
  }

  void step() {
    network.now_ns += kStep_ns;
    const std::int64_t now = network.now_ns;
    network.deliver(SimulatedNetwork::kUp, [&](std::span<const std::byte> d) {
      if (slave_runs) server.on_datagram(master_address, d, now, to_master);
    });
    network.deliver(SimulatedNetwork::kDown, [&](std::span<const std::byte> d) {
      if (const auto packet = client.on_datagram(d, now, to_slave)) {
        statuses.push_back(static_cast<std::uint8_t>(packet->payload[0]));
      }
    });
    if (slave_runs) server.on_time(now, to_master);
    client.on_time(now, to_slave);
  }
  void run(double seconds) {
    for (const std::int64_t until = network.now_ns + static_cast<std::int64_t>(seconds * 1e9); network.now_ns < until;)
      step();
  }
  bool is_up() const {
    return client.state() == SessionClient::State::kConnected && server.session() &&
           server.session()->id == client.session() && client.has_offered_object();
  }
  double seconds_until_up(double limit) {
    const std::int64_t began = network.now_ns;
    while (!is_up() && network.now_ns - began < static_cast<std::int64_t>(limit * 1e9)) step();
    return static_cast<double>(network.now_ns - began) * 1e-9;
  }

  SimulatedNetwork network;
  std::shared_ptr<const Object> object = scene();
  SessionServer server{random_identity(), object};
  SessionClient client{77};
  Address master_address = loopback();
  bool slave_runs = true;
  SessionServer::Send to_master;
  SessionClient::Send to_slave;
  std::vector<std::uint8_t> statuses;
  std::vector<Address> sent_to;
  std::vector<std::vector<std::byte>> sent;  // by the slave
};

TEST(SessionProtocol, GreetsAndTakesTheScene) {
  World world;
  EXPECT_LT(world.seconds_until_up(5), 1.0);
  EXPECT_EQ(world.client.receiver().object()->bytes, world.object->bytes);
  EXPECT_EQ(world.client.trouble(), "");
}

TEST(SessionProtocol, ComesUpOverBadLinksAndStaysUp) {
  for (const char* link : {"rtt=400ms", "rtt=100ms jitter=50ms loss=20%,burst=4 reorder=5% duplicate=10%",
                           "rtt=600ms duplicate=100%", "rtt=0ms loss=50%"}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      World world(link, seed);
      EXPECT_LT(world.seconds_until_up(30), 30) << link << seed;
      world.run(5);
      EXPECT_TRUE(world.is_up()) << link << seed;
      EXPECT_EQ(world.client.counters().losses, 0u) << link << seed;
    }
  }
}

TEST(SessionProtocol, StaysUpWithoutAnythingToSay) {
  World world;
  world.seconds_until_up(5);
  world.run(30);
  EXPECT_TRUE(world.is_up());
  EXPECT_EQ(world.server.counters().sessions, 1u);
}

TEST(SessionProtocol, DoublesTheBackOffWhileNobodyAnswers) {
  World world;
  world.slave_runs = false;
  world.run(10);
  // Hellos at 0, 0.25, 0.75, 1.75, 3.75, 5.75, 7.75, 9.75 s.
  EXPECT_EQ(world.client.counters().hellos, 8u);
  EXPECT_EQ(world.client.trouble(), "no answer yet");
  world.slave_runs = true;
  EXPECT_LE(world.seconds_until_up(5), 2.2);
}

TEST(SessionProtocol, EndsAfterTwoSecondsOfSilenceAndComesBack) {
  World world;
  world.seconds_until_up(5);
  world.network.is_cut = true;
  world.run(1.5);
  EXPECT_EQ(world.client.state(), SessionClient::State::kConnected);
  world.run(0.8);
  EXPECT_EQ(world.client.state(), SessionClient::State::kGreeting);
  EXPECT_FALSE(world.server.session());
  EXPECT_NE(world.client.trouble().find("2 s"), std::string::npos);
  world.network.is_cut = false;
  EXPECT_LE(world.seconds_until_up(5), 2.5);
  EXPECT_EQ(world.client.counters().welcomes, 2u);
}

TEST(SessionProtocol, LivesOnWhatTheHapticLaneHears) {
  World world;
  world.seconds_until_up(5);
  world.network.is_cut = true;
  for (int i = 0; i < 5000; ++i) {
    world.step();
    world.client.heard_at(world.network.now_ns);
    world.server.heard_at(world.network.now_ns);
  }
  EXPECT_TRUE(world.is_up());
}

TEST(SessionProtocol, ComesBackAtOnceAfterTheSlaveWasRestarted) {
  World world;
  world.seconds_until_up(5);
  const std::uint32_t before = world.client.session();
  world.server = SessionServer(random_identity(), world.object);  // kill -9 and start again
  world.run(0.1);
  // The next keep-alive finds that the session is unknown; nobody waits for the silence to be long.
  EXPECT_LT(world.seconds_until_up(5), 0.5);
  EXPECT_NE(world.client.session(), before);
  const auto chunks = [&] {
    return std::count_if(world.sent.begin(), world.sent.end(),
                         [](const auto& d) { return read_packet(d).header.type == PacketType::kChunk; });
  };
  EXPECT_EQ(chunks(), chunks_of(world.object->bytes.size()));  // only the first time
}

TEST(SessionProtocol, FetchesTheSceneAgainIfItIsAnother) {
  World world;
  world.seconds_until_up(5);
  const auto other = scene(2);
  world.server = SessionServer(random_identity(), other);
  world.run(0.3);
  world.seconds_until_up(5);
  EXPECT_EQ(world.client.receiver().object()->bytes, other->bytes);
}

TEST(SessionProtocol, ServesTheRestartedMasterOnceTheOldSessionIsSilent) {
  World world;
  world.seconds_until_up(5);
  world.client = SessionClient(78);  // kill -9 and start again, from the same port
  world.run(0.2);
  EXPECT_NE(world.client.trouble().find("another master"), std::string::npos) << world.client.trouble();
  EXPECT_LE(world.seconds_until_up(10), 4.2);
  EXPECT_EQ(world.server.session()->master, 78u);
}

TEST(SessionProtocol, RefusesASecondMasterAndKeepsTheFirst) {
  World world;
  world.seconds_until_up(5);
  Address other = loopback().with_port(6000);
  PayloadBuffer payload;
  std::array<std::byte, kMaxDatagramBytes> datagram;
  const auto size = write_packet({PacketType::kHello, 0, 0}, write(Hello{99, 1, 5}, payload), datagram);
  world.sent.clear();
  world.sent_to.clear();
  world.server.on_datagram(other, std::span(datagram).first(size), world.network.now_ns, world.to_master);
  ASSERT_EQ(world.sent.size(), 1u);
  EXPECT_EQ(world.sent_to[0], other);
  EXPECT_LE(world.sent[0].size(), size);
  const auto refusal = read_refusal(read_packet(world.sent[0]).payload);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->reason, RefusalReason::kBusy);
  EXPECT_EQ(refusal->master, 99u);
  world.run(3);
  EXPECT_TRUE(world.is_up());
}

TEST(SessionProtocol, SaysGoodbye) {
  World world;
  world.seconds_until_up(5);
  world.client.end(world.to_slave);
  world.run(0.1);
  EXPECT_FALSE(world.server.session());
  EXPECT_EQ(world.server.last_end(), "the master said goodbye");
  EXPECT_EQ(world.client.state(), SessionClient::State::kEnded);
}

TEST(SessionProtocol, GivesTheNewestStatusOnly) {
  World world("rtt=20ms reorder=30% duplicate=30%");
  world.seconds_until_up(5);
  for (std::uint8_t i = 1; i <= 100; ++i) {
    const std::array<std::byte, 1> status{static_cast<std::byte>(i)};
    world.server.send_message(PacketType::kSlaveStatus, status, world.network.now_ns, world.to_master);
    world.run(0.002);
  }
  world.run(0.2);
  ASSERT_GT(world.statuses.size(), 50u);
  EXPECT_TRUE(std::is_sorted(world.statuses.begin(), world.statuses.end()));
  EXPECT_EQ(std::adjacent_find(world.statuses.begin(), world.statuses.end()), world.statuses.end());
}

// Everything that was ever sent, again, from the right address and from a wrong one, bent and unbent: whoever is
// connected stays connected to the same session, and no answer is larger than its question.
TEST(SessionProtocol, IsUnmovedByReplaysStrangersAndBentDatagrams) {
  World world;
  std::vector<std::vector<std::byte>> up, down;
  const auto to_slave = world.to_slave;
  world.to_slave = [&](std::span<const std::byte> d) {
    up.emplace_back(d.begin(), d.end());
    to_slave(d);
  };
  world.seconds_until_up(5);
  world.run(1);
  down = world.sent;
  const std::uint32_t id = world.client.session();
  std::mt19937 random(5);
  const Address stranger = loopback().with_port(6000);
  const SessionClient::Send nowhere = [](std::span<const std::byte>) {};
  for (int round = 0; round < 20; ++round) {
    for (auto datagram : up) {
      const bool is_bye = read_packet(datagram).header.type == PacketType::kBye;
      ASSERT_FALSE(is_bye);
      const bool is_bent = round > 0;
      // Behind the session number: a bent one from the right address with the right number is the master's word.
      if (is_bent) datagram[random() % 12] ^= static_cast<std::byte>(1 + random() % 255);
      std::size_t answer_bytes = 0;
      const auto measure = [&](const Address&, std::span<const std::byte> d) {
        if (read_packet(d).header.type != PacketType::kChunk) answer_bytes = std::max(answer_bytes, d.size());
      };
      world.server.on_datagram(stranger, datagram, world.network.now_ns, measure);
      EXPECT_LE(answer_bytes, datagram.size());
      ASSERT_TRUE(world.server.session());
      EXPECT_EQ(world.server.session()->id, id);
      EXPECT_EQ(world.server.session()->address, world.master_address);
    }
    for (auto datagram : down) {
      const auto type = read_packet(datagram).header.type;
      if (round > 0) datagram[random() % 12] ^= static_cast<std::byte>(1 + random() % 255);
      if (type == PacketType::kBye) continue;
      (void)world.client.on_datagram(datagram, world.network.now_ns, nowhere);
      EXPECT_EQ(world.client.session(), id);
    }
  }
  world.run(3);
  EXPECT_TRUE(world.is_up());
  EXPECT_EQ(world.client.session(), id);
}

TEST(SessionProtocol, TellsAMasterOfAnotherVersionSo) {
  World world;
  std::vector<std::byte> hello(kMaxDatagramBytes);
  PayloadBuffer payload;
  (void)write_packet({PacketType::kHello, 0, 0}, write(Hello{99, 1, 5}, payload), hello);
  hello[2] = std::byte{2};
  world.server.on_datagram(world.master_address, hello, 1, world.to_master);
  ASSERT_EQ(world.sent.size(), 1u);
  EXPECT_EQ(read_refusal(read_packet(world.sent[0]).payload).value().reason, RefusalReason::kOtherVersion);
  EXPECT_FALSE(world.server.session());
  hello.resize(100);
  world.server.on_datagram(world.master_address, hello, 1, world.to_master);
  EXPECT_EQ(world.sent.size(), 1u);  // a short one gets no answer
  // And a master that is answered in another version says so.
  world.sent[0][2] = std::byte{2};
  world.client.on_time(2, [](std::span<const std::byte>) {});
  (void)world.client.on_datagram(world.sent[0], 3, [](std::span<const std::byte>) {});
  EXPECT_NE(world.client.trouble().find("another version"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::transport
