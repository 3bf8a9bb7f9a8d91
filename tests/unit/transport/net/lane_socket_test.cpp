#include "transport/net/lane_socket.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <map>
#include <set>
#include <thread>
#include <vector>

#include "tests/unit/transport/net/ipv6.h"
#include "transport/net/listening_port.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

std::span<const std::byte> text(const char* t) {
  return std::as_bytes(std::span(t, std::strlen(t)));
}
std::string text(const std::optional<Received>& r) {
  return r ? std::string(reinterpret_cast<const char*>(r->bytes.data()), r->bytes.size()) : "nothing";
}

struct Setting {
  const char* name;
  Address listen;  ///< the slave's
  Address asked;   ///< what masters send to
};

class Lanes : public testing::TestWithParam<Setting> {
 protected:
  void SetUp() override {
    const auto& [name, listen, asked] = GetParam();
    if (listen.is_ipv6 && !has_ipv6()) GTEST_SKIP() << "this machine has no IPv6";
    port_.emplace(ListeningPort::open(listen, {.also_ipv4 = listen.is_any() && listen.is_ipv6}).value());
    slave_ = asked.with_port(port_->local().port);
  }
  std::optional<Received> listen() {
    const std::int64_t until = monotonic_ns() + 10 * kSecond;
    do {
      if (auto received = port_->receive(buffer_)) return received;
    } while (port_->wait_until(until));
    return std::nullopt;
  }
  std::optional<Received> receive(LaneSocket& lane) {
    const std::int64_t until = monotonic_ns() + 10 * kSecond;
    do {
      if (auto received = lane.receive(buffer_)) return received;
    } while (lane.wait_until(until));
    return std::nullopt;
  }
  UdpSocket master() { return UdpSocket::open_towards(slave_, {}).value(); }

  std::optional<ListeningPort> port_;
  Address slave_;
  std::array<std::byte, 64> buffer_;
};
INSTANTIATE_TEST_SUITE_P(Port, Lanes,
                         testing::Values(Setting{"IPv4", loopback(false), loopback(false)},
                                         Setting{"IPv6", loopback(true), loopback(true)},
                                         Setting{"AnyIPv4", any_address(false), loopback(false)},
                                         Setting{"AnyIPv6", any_address(true), loopback(true)},
                                         Setting{"BothAsIPv4", any_address(true), loopback(false)}),
                         [](const auto& which) { return which.param.name; });

TEST_P(Lanes, GetTheirPeersDatagramsAndTheListenerAllOthers) {
  auto haptic = port_->make_lane(Dscp::kExpedited).value(), bulk = port_->make_lane(Dscp::kLowerEffort).value();
  EXPECT_NE(haptic.number(), bulk.number());
  EXPECT_FALSE(haptic.send(text("to nobody")));
  auto a = master(), b = master(), stranger = master();
  for (UdpSocket* m : {&a, &b}) {
    ASSERT_TRUE(m->send(text("hello")));
    const auto hello = listen();
    ASSERT_EQ(text(hello), "hello");
    EXPECT_EQ(hello->to, slave_);
    ASSERT_TRUE(port_->answer(*hello, text("welcome")));
    ASSERT_TRUE(m->wait_until(monotonic_ns() + 10 * kSecond));
    EXPECT_EQ(text(m->receive(buffer_)), "welcome");
    ASSERT_TRUE((m == &a ? haptic : bulk).connect_to(hello->from, hello->to));
  }
  EXPECT_EQ(haptic.peer(), a.local());
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(stranger.send(text("stranger")));
    ASSERT_TRUE(a.send(text("pose")));
    ASSERT_TRUE(b.send(text("tile")));
    EXPECT_EQ(text(receive(haptic)), "pose");
    EXPECT_EQ(text(receive(bulk)), "tile");
    EXPECT_EQ(text(listen()), "stranger");
    ASSERT_TRUE(haptic.send(text("contacts")));
    ASSERT_TRUE(bulk.send(text("object")));
    ASSERT_TRUE(a.wait_until(monotonic_ns() + 10 * kSecond) && b.wait_until(monotonic_ns() + 10 * kSecond));
    const auto contacts = a.receive(buffer_);
    EXPECT_EQ(text(contacts), "contacts");
    EXPECT_EQ(contacts->dscp, 46);
    const auto object = b.receive(buffer_);
    EXPECT_EQ(text(object), "object");
    EXPECT_EQ(object->dscp, 1);
  }
  EXPECT_FALSE(port_->receive(buffer_) || haptic.receive(buffer_) || bulk.receive(buffer_));
  EXPECT_EQ(haptic.strays() + bulk.strays(), 0u);
}

TEST_P(Lanes, FollowTheirPeerToAnotherPort) {
  auto lane = port_->make_lane(Dscp::kExpedited).value();
  const Address& place = GetParam().listen;
  auto other_port = UdpSocket::open(
      place, {.also_ipv4 = place.is_any() && place.is_ipv6, .port_use = UdpSocket::Options::Port::kFounds});
  ASSERT_TRUE(other_port);
  auto peer = master();
  ASSERT_TRUE(peer.send(text("1")));
  const auto hello = listen();
  ASSERT_TRUE(lane.connect_to(hello->from, hello->to));
  EXPECT_TRUE(lane.is_connected_to(hello->from, hello->to));

  // It sends to the other port: a stranger there, until the lane joins that port.
  ASSERT_TRUE(peer.connect(slave_.with_port(other_port->local().port)));
  ASSERT_TRUE(peer.send(text("2")));
  ASSERT_TRUE(other_port->wait_until(monotonic_ns() + 10 * kSecond));
  const auto moved = other_port->receive(buffer_);
  ASSERT_EQ(text(moved), "2");
  EXPECT_FALSE(lane.is_connected_to(moved->from, moved->to));
  ASSERT_TRUE(lane.connect_to(moved->from, moved->to));
  ASSERT_TRUE(peer.send(text("3")));
  EXPECT_EQ(text(receive(lane)), "3");
  EXPECT_FALSE(other_port->receive(buffer_));
  ASSERT_TRUE(lane.send(text("4")));
  ASSERT_TRUE(peer.wait_until(monotonic_ns() + 10 * kSecond));
  EXPECT_EQ(text(peer.receive(buffer_)), "4");
}

TEST_P(Lanes, FollowAPeerThatMoved) {
  auto lane = port_->make_lane(Dscp::kExpedited).value();
  auto old_place = master();
  ASSERT_TRUE(old_place.send(text("1")));
  const auto hello = listen();
  ASSERT_TRUE(lane.connect_to(hello->from, hello->to));
  ASSERT_TRUE(old_place.send(text("2")));

  // From a new address it is a stranger to the kernel: the listener passes it on raw, and the lane that opened it
  // moves.
  auto new_place = master();
  ASSERT_TRUE(new_place.send(text("3")));
  const auto moved = listen();
  ASSERT_EQ(text(moved), "3");
  ASSERT_TRUE(port_->pass_on(lane.number(), *moved));
  std::map<std::string, Address> seen;
  for (int i = 0; i < 2; ++i) {
    const auto received = receive(lane);
    ASSERT_TRUE(received);
    seen[text(received)] = received->from;
    if (text(received) == "3") {
      EXPECT_EQ(received->to, slave_);
      EXPECT_EQ(received->from, new_place.local());
      ASSERT_TRUE(old_place.send(text("4")));
      ASSERT_TRUE(lane.connect_to(received->from, received->to));
    }
  }
  EXPECT_EQ(seen.size(), 2u);
  ASSERT_TRUE(new_place.send(text("5")));
  std::set<std::string> rest{text(receive(lane)), text(receive(lane))};
  EXPECT_EQ(rest, (std::set<std::string>{"4", "5"})) << "what waited from the former place is still received";
  ASSERT_TRUE(lane.send(text("6")));
  ASSERT_TRUE(new_place.wait_until(monotonic_ns() + 10 * kSecond));
  EXPECT_EQ(text(new_place.receive(buffer_)), "6");
  ASSERT_TRUE(old_place.send(text("7")));
  EXPECT_EQ(text(listen()), "7") << "the former place is a stranger now";
  EXPECT_EQ(lane.strays(), 0u);
}

class LanesOnEveryAddress : public Lanes {};  // 127.0.0.0/8 is all this machine's, so it has many
INSTANTIATE_TEST_SUITE_P(Port, LanesOnEveryAddress,
                         testing::Values(Setting{"AnyIPv4", any_address(false), loopback(false)},
                                         Setting{"BothAsIPv4", any_address(true), loopback(false)}),
                         [](const auto& which) { return which.param.name; });

TEST_P(LanesOnEveryAddress, FollowAPeerToAnotherOne) {
  auto lane = port_->make_lane(Dscp::kExpedited).value();
  auto first = master();
  ASSERT_TRUE(first.send(text("1")));
  auto hello = listen();
  ASSERT_TRUE(lane.connect_to(hello->from, hello->to));
  Address other = slave_;
  other.ip[3] = 77;
  auto second = UdpSocket::open_towards(other, {}).value();
  ASSERT_TRUE(second.send(text("2")));
  hello = listen();
  ASSERT_EQ(hello->to, other);
  ASSERT_TRUE(first.send(text("3")));
  ASSERT_TRUE(lane.connect_to(hello->from, hello->to));
  ASSERT_TRUE(first.send(text("4")));
  ASSERT_TRUE(second.send(text("5")));
  EXPECT_EQ(text(receive(lane)), "3");
  EXPECT_EQ(text(receive(lane)), "5");
  EXPECT_EQ(text(listen()), "4");
  ASSERT_TRUE(lane.send(text("6")));
  ASSERT_TRUE(second.wait_until(monotonic_ns() + 10 * kSecond));
  EXPECT_EQ(second.receive(buffer_)->from, other);
}

TEST_P(Lanes, GiveBackWhatIsNotTheirs) {
  auto lane = port_->make_lane(Dscp::kExpedited).value();
  auto a = master();
  ASSERT_TRUE(a.send(text("1")));
  const auto hello = listen();
  const Address from = hello->from, to = hello->to;
  ASSERT_TRUE(lane.connect_to(from, to));
  ASSERT_TRUE(a.send(text("next handshake")));
  const auto handshake = receive(lane);
  ASSERT_TRUE(handshake);
  lane.give_back(*handshake);
  const auto returned = listen();
  EXPECT_EQ(text(returned), "next handshake");
  EXPECT_EQ(returned->from, from);
  EXPECT_EQ(returned->to, to);

  ASSERT_TRUE(a.send(text("last")));
  lane.disconnect();
  EXPECT_EQ(lane.peer(), std::nullopt);
  EXPECT_EQ(text(listen()), "last");
  ASSERT_TRUE(a.send(text("later")));
  EXPECT_EQ(text(listen()), "later");
  EXPECT_FALSE(lane.receive(buffer_));
}

TEST_P(Lanes, AreBoundedInNumberAndInWhatWaitsForThem) {
  std::vector<LaneSocket> lanes;
  while (lanes.size() < ListeningPort::kMostLanes) lanes.push_back(port_->make_lane(Dscp::kExpedited).value());
  EXPECT_FALSE(port_->make_lane(Dscp::kExpedited));
  const std::uint32_t freed = lanes.back().number();
  lanes.pop_back();
  auto stranger = master();
  ASSERT_TRUE(stranger.send(text("x")));
  const auto received = listen();
  EXPECT_FALSE(port_->pass_on(freed, *received)) << "the lane is gone";
  EXPECT_FALSE(port_->pass_on(1000, *received)) << "there never was such a lane";
  const auto again = port_->make_lane(Dscp::kExpedited).value();
  EXPECT_EQ(again.number(), freed);

  std::size_t taken = 0;
  while (port_->pass_on(lanes[0].number(), *received)) ASSERT_LE(++taken, LanePost::kSlots);
  EXPECT_EQ(taken, LanePost::kSlots);
  EXPECT_EQ(lanes[0].inbox_dropped(), 1u);
  while (lanes[0].receive(buffer_)) --taken;
  EXPECT_EQ(taken, 0u);
}

TEST_P(Lanes, WakeASleeperForWhatIsPassedOn) {
  auto lane = port_->make_lane(Dscp::kExpedited).value();
  auto a = master();
  std::thread sender([&] {
    ASSERT_TRUE(a.send(text("raw")));
    std::array<std::byte, 64> buffer;
    while (port_->wait_until(monotonic_ns() + 10 * kSecond))
      if (const auto received = port_->receive(buffer)) {
        EXPECT_TRUE(port_->pass_on(lane.number(), *received));
        return;
      }
  });
  EXPECT_EQ(text(receive(lane)), "raw");
  sender.join();
}

TEST_P(Lanes, StayAsTheyAreWhereTheyCannotConnect) {
  auto lane = port_->make_lane(Dscp::kExpedited).value();
  auto a = master();
  ASSERT_TRUE(a.send(text("1")));
  const auto hello = listen();
  const Address from = hello->from, to = hello->to;
  EXPECT_FALSE(lane.connect_to(from, parse_address("192.0.2.1:1").value())) << "not this machine's address";
  EXPECT_EQ(lane.peer(), std::nullopt);
  ASSERT_TRUE(lane.connect_to(from, to));
  EXPECT_FALSE(lane.connect_to(from, parse_address("192.0.2.1:1").value()));
  EXPECT_EQ(lane.peer(), from);
  ASSERT_TRUE(a.send(text("2")));
  EXPECT_EQ(text(receive(lane)), "2");
}

// Strangers flood the port from several sockets while a lane connects, moves between two places of its peer, and lets
// go, over and over. Every datagram is numbered by its sender: the lane is shown none of a stranger's, and all of its
// peer's arrive exactly once, at the lane or, from a place that it had left, at the listener.
TEST_P(Lanes, SeeNoStrangersInAFloodAndLoseNothing) {
  struct Numbered {
    std::uint32_t sender, number;
  };
  constexpr int kStrangers = 3, kRounds = 300;
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> strangers_sent{0}, strangers_seen{0};
  std::vector<std::thread> threads;
  for (std::uint32_t s = 0; s < kStrangers; ++s)
    threads.emplace_back([&, s] {
      auto socket = UdpSocket::open_towards(slave_, {}).value();
      for (std::uint32_t i = 0; !stop; ++i) {
        const Numbered n{100 + s, i};
        if (socket.send(std::as_bytes(std::span(&n, 1)))) ++strangers_sent;
        // Within what the sockets hold, however this thread and the reader are scheduled: the kernel drops nothing.
        while (!stop && strangers_sent - strangers_seen > 1000) std::this_thread::yield();
      }
    });

  auto lane = port_->make_lane(Dscp::kExpedited).value();
  UdpSocket places[2] = {master(), master()};
  std::uint32_t sent = 0;
  std::set<std::uint32_t> of_peer;
  std::uint64_t wrong_at_lane = 0, twice = 0;
  const auto take = [&](const Received& received, bool at_lane) {
    Numbered n;
    ASSERT_EQ(received.bytes.size(), sizeof n);
    std::memcpy(&n, received.bytes.data(), sizeof n);
    ASSERT_EQ(received.to, slave_);
    if (n.sender >= 100) {
      ++strangers_seen;
      wrong_at_lane += at_lane;
    } else if (!of_peer.insert(n.number).second) {
      ++twice;
    }
  };
  const auto read_all = [&] {
    while (const auto received = port_->receive(buffer_)) take(*received, false);
    while (const auto received = lane.receive(buffer_)) take(*received, true);
  };
  const auto send = [&](int place) {
    const Numbered n{static_cast<std::uint32_t>(place), sent};
    if (places[place].send(std::as_bytes(std::span(&n, 1)))) ++sent;
  };
  for (int round = 0; round < kRounds; ++round) {
    const int place = round & 1;
    send(place);
    send(1 - place);
    const Address local = round % 4 == 3 ? any_address(slave_.is_ipv6) : slave_;
    ASSERT_TRUE(lane.connect_to(places[place].local(), local));
    send(place);
    send(1 - place);
    if (round % 3 != 0 || strangers_sent - strangers_seen > 500) read_all();
    if (round % 5 == 0) lane.disconnect();
  }
  stop = true;
  for (std::thread& thread : threads) thread.join();
  for (int i = 0; i < 3; ++i) read_all();  // what the lane gives back, the listener reads in the next turn
  while (lane.receive(buffer_) || port_->receive(buffer_)) ADD_FAILURE() << "still something to read";

  EXPECT_EQ(wrong_at_lane, 0u);
  EXPECT_EQ(twice, 0u);
  // What the kernel was just putting into a socket on another core when that was closed is gone, here as on the way.
  const std::uint64_t all_sent = sent + strangers_sent,
                      all_seen = of_peer.size() + strangers_seen + lane.strays_dropped();
  EXPECT_LE(all_seen, all_sent);
  EXPECT_GE(all_seen + all_sent / 1000, all_sent);
  if (lane.strays_dropped() == 0) {  // the queue was long enough
    EXPECT_GE(of_peer.size() + 1, sent);
  }
  RecordProperty("strays", static_cast<int>(lane.strays()));
}

TEST(ListeningPort, IsNotJoinedByAnotherUser) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  const auto port = ListeningPort::open(any_address(), {}).value();
  for (const Address& address : {any_address(), loopback()}) {
    const pid_t child = fork();
    if (child == 0) {
      if (setuid(65534) != 0) _exit(2);
      const auto thief =
          UdpSocket::open(address.with_port(port.local().port), {.port_use = UdpSocket::Options::Port::kJoins});
      _exit(thief ? 1 : 0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << to_string(address) << ": " << status;
    EXPECT_TRUE(UdpSocket::open(address.with_port(port.local().port), {.port_use = UdpSocket::Options::Port::kJoins}))
        << "while its own user may";
  }
}

TEST(ListeningPort, IsNotFoundedTwice) {
  const auto port = ListeningPort::open(loopback(), {}).value();
  const auto second = ListeningPort::open(port.local(), {});
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("Another program has this port"), std::string::npos);
}

}  // namespace
}  // namespace farfeel::transport
