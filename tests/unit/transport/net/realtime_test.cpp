// What a real-time thread may call on sockets: nothing allocates, frees, locks a mutex or throws.

#include <gtest/gtest.h>

#include "tests/support/realtime_guard.h"
#include "transport/net/listening_port.h"

namespace farfeel::transport {
namespace {

using test_support::RealtimeGuard;

TEST(SocketsInRealTime, NeitherAllocateNorLock) {
  if (!RealtimeGuard::is_available()) GTEST_SKIP() << "sanitizers need malloc and pthread_mutex_lock themselves";
  auto port = ListeningPort::open(any_address(), {}).value();
  auto lane = port.make_lane(Dscp::kExpedited).value();
  const Address slave = loopback().with_port(port.local().port);
  Address other = slave;
  other.ip[3] = 77;
  UdpSocket masters[2] = {UdpSocket::open_towards(slave, {}).value(), UdpSocket::open_towards(other, {}).value()};
  std::array<std::byte, kMostDatagramBytes> buffer, datagram{};
  const std::array<std::span<const std::byte>, 3> burst{datagram, datagram, datagram};
  const std::uint64_t before = RealtimeGuard::violations();
  std::size_t at_lane = 0, at_masters = 0;
  bool is_connected = true;
  {
    const RealtimeGuard guard;
    for (int round = 0; round < 20; ++round) {
      UdpSocket& master = masters[round / 2 % 2];
      (void)master.send(datagram);
      WaitSet either;
      port.add_to(either);
      lane.add_to(either);
      (void)either.wait_until(monotonic_ns() + 1'000'000'000);
      while (const auto received = port.receive(buffer)) {
        (void)port.answer(*received, datagram);
        (void)port.pass_on(lane.number(), *received);
      }
      while (const auto received = lane.receive(buffer)) {
        ++at_lane;
        if (received->from != lane.peer()) is_connected = lane.connect_to(received->from, received->to) && is_connected;
      }
      (void)lane.send(datagram);
      (void)lane.send_burst(burst);
      while (master.receive(buffer)) ++at_masters;
      if (round % 7 == 6) lane.disconnect();
    }
  }
  EXPECT_EQ(RealtimeGuard::violations(), before) << RealtimeGuard::first_violation();
  EXPECT_TRUE(is_connected);
  EXPECT_GE(at_lane, 18u);
  EXPECT_GE(at_masters, 60u);
}

}  // namespace
}  // namespace farfeel::transport
