#include "transport/net/udp_socket.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <thread>
#include <vector>

#include "tests/unit/transport/net/ipv6.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
using Port = UdpSocket::Options::Port;

std::vector<std::byte> bytes(std::size_t size, int fill = 7) {
  return std::vector(size, static_cast<std::byte>(fill));
}

std::optional<Received> wait_for(UdpSocket& socket, std::span<std::byte> buffer) {
  const std::int64_t until = monotonic_ns() + 10 * kSecond;
  while (monotonic_ns() < until) {
    if (auto received = socket.receive(buffer)) return received;
    socket.wait_until(until);
  }
  return std::nullopt;
}

class BothFamilies : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (GetParam() && !has_ipv6()) GTEST_SKIP() << "this machine has no IPv6";
  }
  Address here() const { return loopback(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(Udp, BothFamilies, testing::Bool(),
                         [](const auto& which) { return which.param ? "IPv6" : "IPv4"; });

TEST_P(BothFamilies, CarryDatagramsWithSenderReceiverAndArrival) {
  auto a = UdpSocket::open(here()).value(), b = UdpSocket::open(here()).value();
  std::array<std::byte, 16> buffer;
  EXPECT_FALSE(b.receive(buffer));
  const std::int64_t before = monotonic_ns();
  ASSERT_TRUE(a.send_to(b.local(), bytes(3)));
  const auto received = wait_for(b, buffer);
  ASSERT_TRUE(received);
  EXPECT_EQ(received->from, a.local());
  EXPECT_EQ(received->to, b.local());
  EXPECT_EQ(received->bytes.size(), 3u);
  EXPECT_TRUE(received->time_is_of_arrival);
  EXPECT_GE(received->time_ns, before - 10'000);  // the two clocks are read to within some microseconds
  EXPECT_LE(received->time_ns, monotonic_ns());
  EXPECT_EQ(b.counters().untrusted_times, 0u);
}

TEST_P(BothFamilies, TellWhenADatagramArrivedThatWaited) {
  auto a = UdpSocket::open(here()).value(), b = UdpSocket::open(here()).value();
  std::array<std::byte, 16> buffer;
  // Kernels begin to stamp arrivals some time after the machine's first socket that asks for it; until then the stamp
  // is that of reading.
  bool was_told = false;
  for (int attempt = 0; attempt < 100 && !was_told; ++attempt) {
    EXPECT_FALSE(b.receive(buffer));
    ASSERT_TRUE(a.send_to(b.local(), bytes(3)));
    ASSERT_TRUE(b.wait_until(monotonic_ns() + 10 * kSecond));
    const std::int64_t it_was_there = monotonic_ns();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const auto received = wait_for(b, buffer);
    ASSERT_TRUE(received && received->time_is_of_arrival);
    was_told = received->time_ns <= it_was_there + 10'000;  // the two clocks are read to within some microseconds
  }
  EXPECT_TRUE(was_told);
}

TEST_P(BothFamilies, TellMarkingsAsTheyArrived) {
  auto b = UdpSocket::open(here()).value();
  std::array<std::byte, 16> buffer;
  for (const Dscp dscp : {Dscp::kExpedited, Dscp::kLowerEffort, Dscp::kNotQueueBuilding, Dscp::kBestEffort})
    for (const Ecn ecn : {Ecn::kNotCapable, Ecn::kCapable0, Ecn::kCapable1}) {
      auto a = UdpSocket::open(here(), {.dscp = dscp, .ecn = ecn}).value();
      ASSERT_TRUE(a.send_to(b.local(), bytes(1)));
      const auto received = wait_for(b, buffer);
      ASSERT_TRUE(received && received->has_marking);
      EXPECT_EQ(received->dscp, static_cast<unsigned>(dscp));
      EXPECT_EQ(received->ecn, ecn);
      ASSERT_TRUE(a.send_from(any_address(), b.local(), bytes(1), UdpSocket::Marking{5, Ecn::kCongestion}));
      const auto one = wait_for(b, buffer);
      EXPECT_EQ(one->dscp, 5);
      EXPECT_EQ(one->ecn, Ecn::kCongestion);
      ASSERT_TRUE(a.set_marking(Dscp::kLowerEffort, Ecn::kNotCapable));
      ASSERT_TRUE(a.send_to(b.local(), bytes(1)));
      EXPECT_EQ(wait_for(b, buffer)->dscp, 1);
    }
}

TEST_P(BothFamilies, OnEveryAddressTellAndAnswerFromTheOneThatWasAsked) {
  auto slave = UdpSocket::open(any_address(GetParam())).value();
  std::vector<Address> asked{here().with_port(slave.local().port)};
  if (!GetParam()) {  // 127.0.0.0/8 is all this machine's
    asked.push_back(asked[0]);
    asked.back().ip[3] = 77;
  }
  for (const Address& address : asked) {
    auto master = UdpSocket::open_towards(address, {}).value();
    EXPECT_FALSE(master.local().is_any());
    ASSERT_TRUE(master.send(bytes(2)));
    std::array<std::byte, 16> buffer;
    const auto question = wait_for(slave, buffer);
    ASSERT_TRUE(question);
    EXPECT_EQ(question->to, address);
    EXPECT_EQ(question->from, master.local());
    // A connected socket hears its peer alone: the answer comes from there or not at all.
    ASSERT_TRUE(slave.send_from(question->to, question->from, bytes(3)));
    const auto answer = wait_for(master, buffer);
    ASSERT_TRUE(answer) << to_string(address);
    EXPECT_EQ(answer->from, address);
  }
}

TEST(UdpSocket, ServesBothFamiliesOnOnePort) {
  if (!has_ipv6()) GTEST_SKIP() << "this machine has no IPv6";
  auto slave = UdpSocket::open(any_address(true), {.dscp = Dscp::kExpedited, .also_ipv4 = true}).value();
  for (const bool is_ipv6 : {false, true}) {
    const Address address = loopback(is_ipv6).with_port(slave.local().port);
    auto master = UdpSocket::open_towards(address, {.dscp = Dscp::kLowerEffort}).value();
    ASSERT_TRUE(master.send(bytes(2)));
    std::array<std::byte, 16> buffer;
    const auto question = wait_for(slave, buffer);
    ASSERT_TRUE(question);
    EXPECT_EQ(question->to, address);
    EXPECT_EQ(question->from, master.local());
    EXPECT_TRUE(question->has_marking);
    EXPECT_EQ(question->dscp, 1);
    for (const unsigned dscp : {46u, 7u}) {
      const UdpSocket::Marking marking{static_cast<std::uint8_t>(dscp), Ecn::kNotCapable};
      ASSERT_TRUE(
          slave.send_from(question->to, question->from, bytes(3), dscp == 7 ? std::optional(marking) : std::nullopt));
      const auto answer = wait_for(master, buffer);
      ASSERT_TRUE(answer);
      EXPECT_EQ(answer->from, address);
      EXPECT_EQ(answer->dscp, dscp);
    }
  }
}

TEST_P(BothFamilies, SayThatAPortIsTaken) {
  for (const Port use : {Port::kAlone, Port::kFounds}) {
    const auto first = UdpSocket::open(here(), {.port_use = use}).value();
    for (const Port also : {Port::kAlone, Port::kFounds}) {
      const auto second = UdpSocket::open(first.local(), {.port_use = also});
      ASSERT_FALSE(second);
      EXPECT_EQ(second.error().kind, ErrorKind::kSocket);
      EXPECT_NE(second.error().message.find("Another program has this port"), std::string::npos);
    }
    EXPECT_EQ(UdpSocket::open(first.local(), {.port_use = Port::kJoins}).has_value(), use == Port::kFounds);
  }
}

TEST(UdpSocket, SaysThatAnAddressIsNotHere) {
  const auto socket = UdpSocket::open(parse_address("192.0.2.1:0").value());
  ASSERT_FALSE(socket);
  EXPECT_NE(socket.error().message.find("no such address"), std::string::npos) << socket.error().message;
}

TEST_P(BothFamilies, SendBurstsInOrder) {
  auto b = UdpSocket::open(here()).value();
  auto a = UdpSocket::open_towards(b.local(), {}).value();
  std::vector<std::vector<std::byte>> datagrams;
  for (int i = 0; i < 50; ++i) datagrams.push_back(bytes(100 + static_cast<std::size_t>(i), i));
  std::vector<std::span<const std::byte>> spans(datagrams.begin(), datagrams.end());
  ASSERT_EQ(a.send_burst(spans), 50u);
  std::array<std::byte, 1500> buffer;
  for (const auto& datagram : datagrams) {
    const auto received = wait_for(b, buffer);
    ASSERT_TRUE(received);
    EXPECT_TRUE(std::equal(datagram.begin(), datagram.end(), received->bytes.begin(), received->bytes.end()));
  }
  EXPECT_EQ(a.send_burst({}), 0u);
}

TEST_P(BothFamilies, HearOnlyTheirPeerOnceConnected) {
  auto a = UdpSocket::open(here()).value(), b = UdpSocket::open(here()).value(),
       stranger = UdpSocket::open(here()).value();
  ASSERT_TRUE(a.connect(b.local()));
  ASSERT_TRUE(stranger.send_to(a.local(), bytes(1)));
  ASSERT_TRUE(b.send_to(a.local(), bytes(2)));
  std::array<std::byte, 16> buffer;
  EXPECT_EQ(wait_for(a, buffer)->from, b.local());
  EXPECT_FALSE(a.receive(buffer));
  ASSERT_TRUE(a.connect(stranger.local())) << "another peer later";
  ASSERT_TRUE(b.send_to(a.local(), bytes(2)));
  ASSERT_TRUE(stranger.send_to(a.local(), bytes(1)));
  EXPECT_EQ(wait_for(a, buffer)->from, stranger.local());
  EXPECT_FALSE(a.receive(buffer));
}

TEST_P(BothFamilies, CountWhatTheySkipAndWhatNobodyHears) {
  auto b = std::make_optional(UdpSocket::open(here()).value());
  auto a = UdpSocket::open_towards(b->local(), {}).value();
  ASSERT_TRUE(a.send(bytes(17)));
  ASSERT_TRUE(a.send(bytes(16)));
  std::array<std::byte, 16> buffer;
  EXPECT_EQ(wait_for(*b, buffer)->bytes.size(), 16u);
  EXPECT_EQ(b->counters().skipped_too_long, 1u);
  EXPECT_FALSE(a.send(bytes(70'000)));
  EXPECT_EQ(a.counters().unsent_too_long, 1u);

  b.reset();
  // Each send hears that the one before found nobody, and is made all the same: no answer, forged or not, stops one.
  EXPECT_TRUE(a.send(bytes(1)));
  EXPECT_TRUE(a.send(bytes(1)));
  EXPECT_FALSE(a.receive(buffer));
  EXPECT_GE(a.counters().unreachable, 1u);
  EXPECT_EQ(a.counters().unsent_refused, 0u);
}

TEST(UdpSocket, SendsNothingInFragments) {
  auto a = UdpSocket::open(loopback()).value();
  int discovery = -1;
  socklen_t size = sizeof discovery;
  ASSERT_EQ(getsockopt(a.descriptor(), 0 /* IPPROTO_IP */, 10 /* IP_MTU_DISCOVER */, &discovery, &size), 0);
  EXPECT_EQ(discovery, 3 /* IP_PMTUDISC_PROBE */);
  if (!has_ipv6()) GTEST_SKIP() << "this machine has no IPv6";
  auto b = UdpSocket::open(loopback(true)).value();
  ASSERT_EQ(getsockopt(b.descriptor(), 41 /* IPPROTO_IPV6 */, 23 /* IPV6_MTU_DISCOVER */, &discovery, &size), 0);
  EXPECT_EQ(discovery, 3 /* IPV6_PMTUDISC_PROBE */);
}

TEST(UdpSocket, WaitsNoLongerThanItIsTold) {
  auto a = UdpSocket::open(loopback()).value();
  const std::int64_t start = monotonic_ns();
  EXPECT_FALSE(a.wait_until(start + 2'000'000));
  EXPECT_GE(monotonic_ns(), start + 2'000'000);
  EXPECT_FALSE(a.wait_until(start - kSecond)) << "a time that is past";
}

}  // namespace
}  // namespace farfeel::transport
