// Sockets between two network namespaces: what loopback cannot show.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <optional>
#include <vector>

#include "tests/support/network_namespaces.h"
#include "transport/net/listening_port.h"

namespace farfeel::transport {
namespace {

using Side = NetworkNamespaces::Side;
constexpr std::int64_t kSecond = 1'000'000'000;

class Cable : public testing::Test {
 protected:
  void SetUp() override {
    auto made = NetworkNamespaces::make();
    if (!made) GTEST_SKIP() << made.error();
    net_.emplace(std::move(*made));
  }
  template <typename Socket>
  std::optional<Received> receive(Socket& socket) {
    const std::int64_t until = monotonic_ns() + 10 * kSecond;
    do {
      if (auto received = socket.receive(buffer_)) return received;
    } while (socket.wait_until(until));
    return std::nullopt;
  }
  std::optional<NetworkNamespaces> net_;
  std::array<std::byte, 2048> buffer_;
  const std::array<std::byte, kMostDatagramBytes> datagram_{};
};

TEST_F(Cable, AnswersComeFromTheAddressThatWasAskedAndLanesStayThere) {
  std::optional<ListeningPort> port;
  std::optional<LaneSocket> lane;
  net_->in(Side::kRight, [&] { port.emplace(ListeningPort::open(any_address(true), {.also_ipv4 = true}).value()); });
  lane.emplace(port->make_lane(Dscp::kExpedited).value());
  std::string link_local;
  for (const char* host : {"10.7.0.2", "10.7.0.12", "fd07::2", "link-local"}) {
    std::optional<UdpSocket> master;
    std::optional<Received> hello;
    if (std::string(host) == "link-local") {
      // Multicast to all nodes of the cable tells the other side's link-local address, with this side's scope.
      net_->in(Side::kLeft, [&] {
        const auto all = parse_address("[ff02::1]:" + std::to_string(port->local().port)).value();
        Address there = all;
        there.scope_id = parse_address("[fe80::1%cable]:1").value().scope_id;
        auto asker = UdpSocket::open(any_address(true)).value();
        ASSERT_TRUE(asker.send_to(there, datagram_));
        const auto asked = receive(*port);
        ASSERT_TRUE(asked);
        EXPECT_TRUE(asked->from.is_link_local());
        EXPECT_NE(asked->from.scope_id, 0u);
        ASSERT_TRUE(port->send_to(asked->from, datagram_));
      });
      // From there it is known; the master asks it by name of its interface.
      net_->in(Side::kLeft, [&] {
        FILE* const out = popen("ip -6 neighbour show dev cable | grep ^fe80 | head -1 | cut -d' ' -f1", "r");
        char text[64] = "";
        if (fgets(text, sizeof text, out) != nullptr) link_local = std::string(text, strcspn(text, "\n"));
        pclose(out);
        ASSERT_FALSE(link_local.empty());
        const auto slave = parse_address("[" + link_local + "%cable]:" + std::to_string(port->local().port));
        ASSERT_TRUE(slave) << slave.error().message;
        master.emplace(UdpSocket::open_towards(*slave, {}).value());
      });
    } else {
      const auto slave = parse_address(host, port->local().port).value();
      net_->in(Side::kLeft, [&] { master.emplace(UdpSocket::open_towards(slave, {}).value()); });
    }
    ASSERT_TRUE(master->send(datagram_)) << host;
    hello = receive(*port);
    ASSERT_TRUE(hello) << host;
    const Address from = hello->from, to = hello->to;
    EXPECT_TRUE(from.has_ip_of(master->local()) || from.is_link_local());  // scopes are each machine's own
    EXPECT_FALSE(to.is_any());
    ASSERT_TRUE(port->answer(*hello, datagram_)) << host;
    ASSERT_TRUE(receive(*master)) << host << ": a connected socket hears the address alone that it asked";

    net_->in(Side::kRight, [&] { ASSERT_TRUE(lane->connect_to(from, to)) << host; });
    ASSERT_TRUE(master->send(datagram_));
    const auto pose = receive(*lane);
    ASSERT_TRUE(pose) << host;
    EXPECT_EQ(pose->bytes.size(), kMostDatagramBytes);
    EXPECT_EQ(pose->from, from);
    ASSERT_TRUE(lane->send(datagram_));
    const auto contacts = receive(*master);
    ASSERT_TRUE(contacts) << host;
    EXPECT_EQ(contacts->dscp, 46);
  }
}

TEST_F(Cable, CarriesInOnePieceOrNotAtAll) {
  for (const char* host : {"10.7.0.2", "fd07::2"}) {
    std::optional<UdpSocket> slave, master;
    net_->in(Side::kRight, [&] { slave.emplace(UdpSocket::open(parse_address(host, 0).value()).value()); });
    net_->in(Side::kLeft, [&] { master.emplace(UdpSocket::open_towards(slave->local(), {}).value()); });
    const std::vector<std::byte> longer(1473);  // one more than IPv4 and UDP leave of 1500
    EXPECT_FALSE(master->send(longer)) << host;
    EXPECT_EQ(master->counters().unsent_too_long, 1u);
    ASSERT_TRUE(master->send(datagram_));
    EXPECT_EQ(receive(*slave)->bytes.size(), kMostDatagramBytes);
  }
}

}  // namespace
}  // namespace farfeel::transport
