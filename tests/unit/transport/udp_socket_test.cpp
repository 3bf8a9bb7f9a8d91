#include "transport/udp_socket.h"

#include <gtest/gtest.h>

namespace farfeel::transport {
namespace {

std::string round_trip(const std::string& text) {
  const auto address = loopback_address(text, 7);
  return address ? to_string(*address) : address.error().message;
}

TEST(LoopbackAddress, ReadsWhatItWrites) {
  EXPECT_EQ(round_trip("127.0.0.1:4000"), "127.0.0.1:4000");
  EXPECT_EQ(round_trip("127.1.2.3:1"), "127.1.2.3:1");
  EXPECT_EQ(round_trip("[::1]:4000"), "[::1]:4000");
  EXPECT_EQ(round_trip("localhost:4000"), "127.0.0.1:4000");
  EXPECT_EQ(round_trip("::1"), "[::1]:7");
  EXPECT_EQ(round_trip("[::1]"), "[::1]:7");
  EXPECT_EQ(round_trip("127.0.0.1"), "127.0.0.1:7");
}

TEST(LoopbackAddress, SaysWhatItCannotRead) {
  for (const char* text : {"", ":", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:-1", "127.0.0.1:4000x", "127.0.0.1:4 ",
                           "[::1", "[::1]4000", "[::1]:", "host:4000", "127.0.0:1", "127.0.0.1.5:1", "[127.0.0.1:4"}) {
    const auto address = loopback_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().kind, ErrorKind::kAddress) << text;
    EXPECT_NE(address.error().message.find("Write 127.0.0.1:4000"), std::string::npos);
  }
}

TEST(LoopbackAddress, RefusesEveryOtherNetworkAndSaysWhy) {
  for (const char* text : {"10.0.0.1:4000", "192.168.1.5:4000", "0.0.0.0:4000", "128.0.0.1:4000", "[::]:4000",
                           "[fe80::1]:4000", "[::ffff:10.0.0.1]:4000", "[::ffff:127.0.0.1]:4000"}) {
    const auto address = loopback_address(text);
    ASSERT_FALSE(address) << text;
    EXPECT_EQ(address.error().kind, ErrorKind::kRefused) << text;
    EXPECT_NE(address.error().message.find("not encrypted"), std::string::npos);
    EXPECT_NE(address.error().message.find("Use 127.0.0.1"), std::string::npos);
  }
}

TEST(UdpSocket, RefusesAddressesThatWereNotReadByUs) {
  Address everywhere;  // 0.0.0.0
  EXPECT_EQ(UdpSocket::open(everywhere).error().kind, ErrorKind::kRefused);
  auto socket = UdpSocket::open(loopback()).value();
  everywhere.ip = {10, 0, 0, 1};
  EXPECT_EQ(socket.connect(everywhere).error().kind, ErrorKind::kRefused);
}

TEST(UdpSocket, SaysThatAPortIsTaken) {
  const auto first = UdpSocket::open(loopback()).value();
  const auto second = UdpSocket::open(first.local());
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("Another program has this port"), std::string::npos);
}

TEST(UdpSocket, OpensNeighbouringPorts) {
  const auto pair = UdpSocket::open_pair(loopback()).value();
  EXPECT_EQ(pair[1].local().port, pair[0].local().port + 1);
  EXPECT_FALSE(UdpSocket::open_pair(loopback().with_port(0xFFFF)));
}

TEST(UdpSocket, CarriesDatagramsWithSenderAndArrival) {
  for (const bool is_ipv6 : {false, true}) {
    auto a = UdpSocket::open(loopback(is_ipv6)).value(), b = UdpSocket::open(loopback(is_ipv6)).value();
    std::array<std::byte, 16> buffer;
    EXPECT_FALSE(b.receive(buffer));
    const std::int64_t before = monotonic_ns();
    const std::array<std::byte, 3> message{std::byte{1}, std::byte{2}, std::byte{3}};
    ASSERT_TRUE(a.send_to(b.local(), message));
    ASSERT_TRUE(b.wait_until(monotonic_ns() + 10'000'000'000));
    const auto received = b.receive(buffer);
    ASSERT_TRUE(received);
    EXPECT_EQ(received->from, a.local());
    EXPECT_EQ(received->bytes.size(), 3u);
    EXPECT_LE(received->time_ns, monotonic_ns());
    EXPECT_GE(received->time_ns, before - 1'000'000);
  }
}

TEST(UdpSocket, SkipsWhatIsLongerThanTheBuffer) {
  auto a = UdpSocket::open(loopback()).value(), b = UdpSocket::open(loopback()).value();
  const std::array<std::byte, 100> long_one{};
  const std::array<std::byte, 3> short_one{};
  a.send_to(b.local(), long_one);
  a.send_to(b.local(), short_one);
  ASSERT_TRUE(b.wait_until(monotonic_ns() + 10'000'000'000));
  std::array<std::byte, 16> buffer;
  EXPECT_EQ(b.receive(buffer).value().bytes.size(), 3u);
}

TEST(UdpSocket, OnceConnectedHearsOnlyItsPeer) {
  auto a = UdpSocket::open(loopback()).value(), b = UdpSocket::open(loopback()).value(),
       stranger = UdpSocket::open(loopback()).value();
  ASSERT_TRUE(b.connect(a.local()));
  const std::array<std::byte, 3> message{};
  stranger.send_to(b.local(), std::span(message).first(1));
  a.send_to(b.local(), message);
  ASSERT_TRUE(b.wait_until(monotonic_ns() + 10'000'000'000));
  std::array<std::byte, 16> buffer;
  EXPECT_EQ(b.receive(buffer).value().bytes.size(), 3u);
  EXPECT_FALSE(b.receive(buffer));
}

}  // namespace
}  // namespace farfeel::transport
