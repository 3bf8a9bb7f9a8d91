// Both ends' sessions over a relay, on this machine, where a direct way past it is always found.

#include <thread>

#include "tests/end_to_end/session/both_ends.h"
#include "tests/support/realtime_guard.h"
#include "transport/relay/relay_server.h"

namespace farfeel::end_to_end {
namespace {

const transport::Key32 kKeyOfRelay = {std::byte{7}};

/// What farfeel-relay does, on a thread of its own.
class RunningRelay {
 public:
  RunningRelay()
      : socket_(transport::UdpSocket::open(transport::loopback()).value()),
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
