// The relay over real loopback sockets: everything arrives, both ways, for several masters.

#include "transport/link/relay.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <thread>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kPatience_ns = 20'000'000'000;

class RunningRelay {
 public:
  RunningRelay(const Address& slave, const std::string& link)
      : relay_(Relay::open({loopback(slave.is_ipv6), slave, parse_link_spec(link).value(), 1}).value()),
        thread_([this] { relay_->run(stop_, std::numeric_limits<std::int64_t>::max()); }) {}
  ~RunningRelay() {
    if (thread_.joinable()) (void)finish();
  }
  const Address& local() const { return relay_->local(); }
  Relay::Summary finish() {
    stop_.store(true);
    thread_.join();
    return relay_->summary();
  }

 private:
  std::unique_ptr<Relay> relay_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

std::optional<std::pair<std::string, Address>> receive(UdpSocket& socket) {
  std::array<std::byte, 2000> buffer;
  const std::int64_t until = monotonic_ns() + kPatience_ns;
  while (monotonic_ns() < until) {
    if (!socket.wait_until(until)) continue;
    if (const auto received = socket.receive(buffer))
      return std::pair(std::string(reinterpret_cast<const char*>(received->bytes.data()), received->bytes.size()),
                       received->from);
  }
  return std::nullopt;
}

std::span<const std::byte> bytes(const std::string& text) {
  return std::as_bytes(std::span(text));
}

void pass_both_ways(bool is_ipv6) {
  auto slave = UdpSocket::open(loopback(is_ipv6)).value();
  RunningRelay relay(slave.local(), "rtt=2ms");
  auto one = UdpSocket::open(loopback(is_ipv6)).value(), two = UdpSocket::open(loopback(is_ipv6)).value();
  ASSERT_TRUE(one.send_to(relay.local(), bytes("from one")));
  const auto first = receive(slave);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->first, "from one");
  ASSERT_TRUE(two.send_to(relay.local(), bytes("from two")));
  const auto second = receive(slave);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->first, "from two");
  EXPECT_NE(first->second, second->second);  // a path of its own for each master
  slave.send_to(first->second, bytes("to one"));
  slave.send_to(second->second, bytes("to two"));
  EXPECT_EQ(receive(one).value().first, "to one");
  EXPECT_EQ(receive(two).value().first, "to two");
  const auto summary = relay.finish();
  EXPECT_EQ(summary.up.sent, 2u);
  EXPECT_EQ(summary.down.sent, 2u);
  EXPECT_EQ(summary.release_error.samples, 4u);
}

TEST(Relay, PassesDatagramsBothWays) {
  pass_both_ways(false);
}
TEST(Relay, PassesDatagramsBothWaysOverIpv6) {
  pass_both_ways(true);
}

TEST(Relay, NeverReleasesEarly) {
  auto slave = UdpSocket::open(loopback()).value();
  RunningRelay relay(slave.local(), "rtt=20ms");
  auto master = UdpSocket::open(loopback()).value();
  for (int i = 0; i < 20; ++i) {
    const std::int64_t before = monotonic_ns();
    master.send_to(relay.local(), bytes("ping"));
    ASSERT_TRUE(receive(slave));
    EXPECT_GE(monotonic_ns() - before, 10'000'000);
  }
}

TEST(Relay, SaysInOneLineOfJsonWhatBecameOfTheDatagrams) {
  auto slave = UdpSocket::open(loopback()).value();
  const Relay::Options options{loopback(), slave.local(), parse_link_spec("loss=100%").value(), 9};
  const auto relay = Relay::open(options).value();
  auto master = UdpSocket::open(loopback()).value();
  for (int i = 0; i < 5; ++i) master.send_to(relay->local(), bytes("x"));
  std::atomic<bool> stop{false};
  relay->run(stop, monotonic_ns() + 20'000'000);
  const std::string json = to_json(options, relay->summary());
  EXPECT_NE(json.find("\"up\": {\"received\": 5, \"lost\": 5"), std::string::npos) << json;
  EXPECT_NE(json.find("\"valid\": true"), std::string::npos) << json;
  EXPECT_EQ(json.find('\n'), std::string::npos);
}

TEST(Relay, RefusesWhatIsNotOfThisMachine) {
  Address far_away;
  far_away.ip = {192, 0, 2, 1};
  far_away.port = 5;
  EXPECT_EQ(Relay::open({loopback(), far_away, {}, 1}).error().kind, ErrorKind::kRefused);
  EXPECT_EQ(Relay::open({far_away, loopback().with_port(5), {}, 1}).error().kind, ErrorKind::kRefused);
}

}  // namespace
}  // namespace farfeel::transport
