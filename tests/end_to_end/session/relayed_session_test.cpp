// Both ends' sessions over a relay: on this machine, where a direct way past it is always found, and on three machines
// with NATs between them.

#include <thread>

#include "tests/end_to_end/session/both_ends.h"
#include "tests/support/realtime_guard.h"
#include "tests/support/simulated_internet.h"
#include "transport/relay/relay_server.h"

namespace farfeel::end_to_end {
namespace {

const transport::Key32 kKeyOfRelay = {std::byte{7}};

/// What farfeel-relay does, on a thread of its own.
class RunningRelay {
 public:
  explicit RunningRelay(const transport::Address& at = transport::loopback())
      : socket_(transport::UdpSocket::open(at).value()),
        local_(socket_.local()),
        thread_([this](const std::stop_token& stop) { run(stop); }) {}
  const transport::Address& local() const { return local_; }
  std::uint64_t forwarded() const { return forwarded_.load(); }

 private:
  void run(const std::stop_token& stop) {
    transport::RelayServer server(kKeyOfRelay, transport::random_key());
    std::array<std::byte, 2048> buffer;
    while (!stop.stop_requested()) {
      socket_.wait_until(transport::monotonic_ns() + 10'000'000);
      while (const auto received = socket_.receive(buffer)) {
        for (const auto& out : server.receive(*received, transport::monotonic_ns(), kNow_s))
          socket_.send_from(out.local, out.to, out.bytes, out.marking);
      }
      forwarded_.store(server.counters().forwarded);
    }
  }
  static constexpr std::uint64_t kNow_s = 1'000'000;
  transport::UdpSocket socket_;
  transport::Address local_;
  std::atomic<std::uint64_t> forwarded_{0};
  std::jthread thread_;
};

transport::RelayAccess access(const RunningRelay& relay, const transport::Key32& key = kKeyOfRelay) {
  return {relay.local(), transport::make_token(key, {1, 2'000'000, 100'000, 8}), "room",
          static_cast<std::uint64_t>(transport::wall_clock_ns())};
}

std::unique_ptr<SlaveSession> slave_at(const RunningRelay& relay, slave_sim::ContactSource& contacts) {
  auto options = slave_options(transport::loopback());
  options.relay = access(relay);
  return SlaveSession::start(options, scene(), contacts).value();
}

MasterSession::Options options_for(const RunningRelay& relay, double patience_s = 20) {
  auto options = master_options({}, patience_s);
  options.slave.clear();
  options.relay = access(relay);
  return options;
}

bool is_past_the_relay(const MasterSession& session) {
  return session.way().find("past the relay") != std::string::npos;
}

TEST(RelayedSession, GoesPastTheRelayAndKeepsTheHapticThreadFree) {
  Floor floor;
  const RunningRelay relay;
  const auto remote = slave_at(relay, floor);
  const auto session = MasterSession::connect(options_for(relay)).value();
  EXPECT_NE(session->way().find("over the relay"), std::string::npos) << session->way();

  // The way changes while the haptic thread runs, which neither allocates nor locks meanwhile.
  const auto before = test_support::RealtimeGuard::violations();
  contact::ContactSet newest;
  std::uint32_t sequence = 0;
  int ticks_past_it = 0;
  for (const auto until = std::chrono::steady_clock::now() + kPatience;
       std::chrono::steady_clock::now() < until && ticks_past_it < 300;) {
    {
      const std::optional<test_support::RealtimeGuard> guard =
          test_support::RealtimeGuard::is_available() ? std::optional<test_support::RealtimeGuard>(std::in_place)
                                                      : std::nullopt;
      master_station::ToolState state;
      state.sequence = ++sequence;
      session->remote().send(state);
      (void)session->remote().poll(newest);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ticks_past_it += is_past_the_relay(*session);
  }
  EXPECT_EQ(ticks_past_it, 300) << session->way();
  EXPECT_EQ(test_support::RealtimeGuard::violations(), before) << test_support::RealtimeGuard::first_violation();
  EXPECT_TRUE(feels(*session, sequence));
  EXPECT_GT(relay.forwarded(), 0u);
  EXPECT_EQ(session->report().sessions, 1u);
  EXPECT_EQ(floor.restarts.load(), 1);
}

// 25 ms and a NAT lie before each machine. The direct way is blocked, opens while the tool touches, and is blocked
// again.
TEST(RelayedSession, ChangesItsWayUnderContacts) {
  auto made = SimulatedInternet::make(3, 25'000'000);
  if (!made) GTEST_SKIP() << made.error();
  SimulatedInternet& net = **made;
  const transport::NatKind nat{transport::Looks::kNowhere, transport::Looks::kAtHostAndPort};
  ASSERT_TRUE(net.place(0, "10.0.0.1", SimulatedInternet::BehindNat{"203.0.113.1", nat}));
  ASSERT_TRUE(net.place(1, "10.0.0.2", SimulatedInternet::BehindNat{"203.0.113.2", nat}));
  ASSERT_TRUE(net.place(2, "198.51.100.1"));
  net.block_direct_ways(true);
  Floor floor;
  std::optional<RunningRelay> relay;
  std::unique_ptr<SlaveSession> remote;
  std::unique_ptr<MasterSession> session;
  net.in(2, [&] { relay.emplace(transport::parse_address("198.51.100.1:47200").value()); });
  net.in(1, [&] { remote = slave_at(*relay, floor); });
  net.in(0, [&] { session = MasterSession::connect(options_for(*relay)).value(); });
  std::uint32_t sequence = 0;
  ASSERT_TRUE(feels(*session, sequence));
  EXPECT_FALSE(is_past_the_relay(*session));

  // Until so many poses were sent after the way was as it is wanted.
  const auto feel_until = [&](bool is_past, int then) {
    contact::ContactSet newest;
    for (const auto until = std::chrono::steady_clock::now() + kPatience;
         then > 0 && std::chrono::steady_clock::now() < until;) {
      master_station::ToolState state;
      state.sequence = ++sequence;
      state.time_ns = transport::monotonic_ns();
      session->remote().send(state);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      (void)session->remote().poll(newest);
      if (is_past_the_relay(*session) == is_past) --then;
    }
    return then == 0;
  };
  net.block_direct_ways(false);
  ASSERT_TRUE(feel_until(true, 500)) << session->way();
  EXPECT_GT(net.passed_two_nats(), 0u);
  const auto report = session->report();
  // None was lost where nothing else ran; 0.1 s of silence would lose 100 of each.
  EXPECT_LT(report.up.lost, 50u);
  EXPECT_LT(report.down.lost, 50u);

  net.block_direct_ways(true);
  ASSERT_TRUE(feel_until(false, 100)) << session->way();
  EXPECT_TRUE(feels(*session, sequence));
  EXPECT_EQ(session->report().sessions, 1u);
}

TEST(RelayedSession, IsADirectOneWhereTheAddressAnswers) {
  Floor floor;
  const RunningRelay relay;
  const auto remote = slave_at(relay, floor);
  auto options = options_for(relay);
  options.slave = {remote->local()};
  const auto session = MasterSession::connect(options).value();
  EXPECT_EQ(session->way(), "to " + transport::to_string(remote->local()));
  std::uint32_t sequence = 0;
  EXPECT_TRUE(feels(*session, sequence));
}

TEST(RelayedSession, IsFoundOverTheRelayWhereTheAddressIsSilent) {
  Floor floor;
  const RunningRelay relay;
  const auto remote = slave_at(relay, floor);
  const auto silent = transport::UdpSocket::open(transport::loopback()).value();
  auto options = options_for(relay);
  options.slave = {silent.local()};
  const auto session = MasterSession::connect(options).value();
  std::uint32_t sequence = 0;
  EXPECT_TRUE(feels(*session, sequence));
  EXPECT_EQ(session->slave(), relay.local());
}

TEST(RelayedSession, ComesBackAfterTheSlaveIsRestarted) {
  Floor floor;
  const RunningRelay relay;
  auto remote = slave_at(relay, floor);
  const auto session = MasterSession::connect(options_for(relay)).value();
  std::uint32_t sequence = 0;
  ASSERT_TRUE(feels(*session, sequence));
  remote.reset();
  remote = slave_at(relay, floor);
  EXPECT_TRUE(feels(*session, sequence));
  EXPECT_EQ(session->report().sessions, 2u);
}

TEST(RelayedSession, SaysWhatIsWrongAtTheRelay) {
  const RunningRelay relay;
  const auto alone = MasterSession::connect(options_for(relay, 1));
  ASSERT_FALSE(alone);
  EXPECT_NE(alone.error().message.find("the slave is not at the relay"), std::string::npos) << alone.error().message;
  auto options = options_for(relay, 1);
  options.relay = access(relay, {std::byte{8}});
  const auto refused = MasterSession::connect(options);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("does not know this token"), std::string::npos) << refused.error().message;
}

}  // namespace
}  // namespace farfeel::end_to_end
