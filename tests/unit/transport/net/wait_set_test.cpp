#include "transport/net/wait_set.h"

#include <gtest/gtest.h>

#include <thread>

#include "transport/net/udp_socket.h"

namespace farfeel::transport {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(WaitSet, WakesForAnySocketAndForEvents) {
  auto a = UdpSocket::open(loopback()).value(), b = UdpSocket::open(loopback()).value();
  const auto event = WakeEvent::open().value();
  const auto wait = [&](std::int64_t for_ns) {
    WaitSet set;
    set.add(a.descriptor());
    set.add(-1);
    set.add(event);
    return set.wait_until(monotonic_ns() + for_ns);
  };
  EXPECT_FALSE(wait(0));
  const std::byte byte{1};
  ASSERT_TRUE(b.send_to(a.local(), {&byte, 1}));
  EXPECT_TRUE(wait(10 * kSecond));
  EXPECT_TRUE(wait(10 * kSecond)) << "a datagram counts until it is read";
  std::array<std::byte, 8> buffer;
  EXPECT_TRUE(a.receive(buffer));
  EXPECT_FALSE(wait(0));
  event.signal();
  event.signal();
  EXPECT_TRUE(wait(10 * kSecond));
  EXPECT_FALSE(wait(0)) << "an event wakes once";
  std::thread other([&] { event.signal(); });
  EXPECT_TRUE(wait(60 * kSecond));
  other.join();
}

TEST(WaitSet, SleepsWithNothingToWaitFor) {
  const std::int64_t until = monotonic_ns() + 1'000'000;
  EXPECT_FALSE(WaitSet().wait_until(until));
  EXPECT_GE(monotonic_ns(), until);
}

}  // namespace
}  // namespace farfeel::transport
