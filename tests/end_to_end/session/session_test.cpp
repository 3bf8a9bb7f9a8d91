// Both ends of a session in one process, over real loopback sockets.

#include "haptic_core/teleoperation/handle_end.h"
#include "tests/end_to_end/session/both_ends.h"
#include "tests/support/realtime_guard.h"
#include "transport/link/relay.h"

namespace farfeel::end_to_end {
namespace {

TEST(Session, CarriesTheSceneThenPosesAndContacts) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  EXPECT_EQ(session->scene().tool.name, "needle");
  EXPECT_EQ(session->scene().objects.at(0).visible_O.triangles.size(), 4u);
  std::uint32_t sequence = 0;
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(feels(*session, sequence));
  EXPECT_EQ(session->state(), MasterSession::State::kConnected);
  EXPECT_GE(session->remote().newest_round_trip_ms(), 0.0);
}

TEST(Session, HandsEditsToTheThreadThatAnswers) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  std::uint32_t sequence = 0;
  for (std::uint32_t i = 1; i <= 300; ++i) remote->edit({{0, i}, {i, {}}});  // more than wait at a time
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (floor.edits < 300 && std::chrono::steady_clock::now() < until) ASSERT_TRUE(feels(*session, sequence));
  EXPECT_EQ(floor.edits, 300);
}

TEST(Session, SpeaksIpv6) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback(true));
  const auto session = master(remote->local());
  std::uint32_t sequence = 0;
  EXPECT_TRUE(feels(*session, sequence));
}

TEST(Session, LetsTheSlaveSimulateTheToolForWavesAndForPassivity) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  std::uint32_t sequence = 0;
  std::int64_t time_ns = transport::monotonic_ns();
  for (const auto controller : {teleoperation::Controller::kWaves, teleoperation::Controller::kPassivity}) {
    teleoperation::HandleEnd handle(controller);
    spatial::Vector6 down = spatial::Vector6::Zero();
    down[5] = -0.02;
    teleoperation::LineValue out{.by = controller};
    contact::ContactSet newest;
    bool has_pressed = false;
    const auto until = std::chrono::steady_clock::now() + kPatience;
    while (!has_pressed && std::chrono::steady_clock::now() < until) {
      master_station::ToolState state;
      state.sequence = ++sequence;
      state.time_ns = time_ns += 1'000'000;
      state.X_WT.p = {0, 0, 1e-3};  // where the remote's tool begins
      state.line = out;
      session->remote().send(state);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      session->remote().poll(newest);
      out = handle.tick(down, session->remote().line(), 1e-3).out;
      has_pressed = newest.count == 1 && newest.X_WT.p.z < -1e-4 && newest.contacts[0].depth_m > 1e-4;
    }
    EXPECT_TRUE(has_pressed) << name(controller);
  }
}

TEST(Session, ReportsWhatReachedBothEnds) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  std::uint32_t sequence = 0;
  const auto until = std::chrono::steady_clock::now() + kPatience;
  master_station::LinkReport report;
  do {
    ASSERT_TRUE(feels(*session, sequence));
    report = session->report();
  } while ((!report.slave || report.up.received == 0 || report.round_trip.samples == 0) &&
           std::chrono::steady_clock::now() < until);
  EXPECT_GT(report.up.received, 0u);
  EXPECT_GE(report.up.sent, report.up.received);
  EXPECT_GT(report.down.received, 0u);
  EXPECT_EQ(report.up.duplicate + report.down.duplicate + report.malformed, 0u);
  EXPECT_EQ(report.sessions, 1u);
  EXPECT_GT(report.round_trip.p99_ms, 0.0);
}

TEST(Session, AccountsForEveryPoseOnceTheLoopHasStopped) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  std::uint32_t sequence = 0;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(feels(*session, sequence));
  const auto report = session->last_report();
  EXPECT_GT(report.up.sent, 0u);
  EXPECT_LE(report.up.sent, sequence);  // some ticks passed before the lane had keys
  EXPECT_EQ(report.up.received + report.up.lost, report.up.sent);
}

TEST(Session, ComesBackAfterTheSlaveIsRestarted) {
  Floor floor;
  auto remote = slave(floor, transport::loopback());
  const auto address = remote->local();
  const auto session = master(address);
  std::uint32_t sequence = 0;
  ASSERT_TRUE(feels(*session, sequence));
  remote.reset();
  remote = slave(floor, address);
  EXPECT_TRUE(feels(*session, sequence));
  EXPECT_EQ(session->report().sessions, 2u);
  EXPECT_EQ(session->state(), MasterSession::State::kConnected);
}

TEST(Session, FeelsNothingOfAnotherSceneUntilItIsAdopted) {
  Floor floor;
  auto remote = slave(floor, transport::loopback());
  const auto address = remote->local();
  const auto session = master(address);
  remote.reset();
  remote = slave(floor, address, scene(0.3));
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (session->state() != MasterSession::State::kOtherScene && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ASSERT_EQ(session->state(), MasterSession::State::kOtherScene);
  ASSERT_TRUE(session->adopt_scene());
  EXPECT_NEAR(session->scene().objects.at(0).visible_O.positions_O.at(0).x +
                  session->scene().objects.at(0).visible_O.positions_O.at(1).x +
                  session->scene().objects.at(0).visible_O.positions_O.at(2).x +
                  session->scene().objects.at(0).visible_O.positions_O.at(3).x,
              0.3, 1e-3);
  std::uint32_t sequence = 0;
  EXPECT_TRUE(feels(*session, sequence));
}

TEST(Session, RefusesASecondMasterWithTheReason) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  std::string last;
  auto options = master_options(remote->local(), 1.5);
  options.progress = [&](const std::string& doing, double) { last = doing; };
  const auto second = MasterSession::connect(options);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another master"), std::string::npos) << second.error().message;
  EXPECT_NE(last.find("another master"), std::string::npos) << last;
}

TEST(Session, SaysThatNobodyAnswers) {
  const auto nobody = transport::UdpSocket::open(transport::loopback()).value().local();
  const auto session = MasterSession::connect(master_options(nobody, 0.2));
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().kind, transport::ErrorKind::kTimeout);
}

TEST(Session, IsUnmovedByJunkOnTheSlavesPort) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  std::uint32_t sequence = 0;
  ASSERT_TRUE(feels(*session, sequence));
  auto hostile = transport::UdpSocket::open(transport::loopback()).value();
  std::array<std::byte, 1200> junk{};
  std::uint32_t random = 1;
  for (int i = 0; i < 2000; ++i) {
    for (std::byte& b : junk) b = static_cast<std::byte>((random = random * 1664525u + 1013904223u) >> 24);
    junk[0] = static_cast<std::byte>(i % 6);  // as far as it can get without a key
    if (i % 6 == 4) junk[1] = junk[2] = junk[3] = std::byte{0};
    hostile.send_to(remote->local(), std::span(junk).first(i % 3 == 0 ? transport::kInitiationBytes : random % 1201));
  }
  EXPECT_TRUE(feels(*session, sequence));
  const auto report = session->report();
  EXPECT_EQ(report.sessions, 1u);
  EXPECT_EQ(floor.restarts.load(), 1);
}

TEST(Session, KeepsTheHapticThreadFreeOfAllocationAndLocks) {
  if (!test_support::RealtimeGuard::is_available())
    GTEST_SKIP() << "the guard needs malloc for itself, as sanitizers do";
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const auto session = master(remote->local());
  std::uint32_t sequence = 0;
  ASSERT_TRUE(feels(*session, sequence));
  const auto before = test_support::RealtimeGuard::violations();
  contact::ContactSet newest;
  for (int i = 0; i < 300; ++i) {  // longer than it takes to publish the histogram
    {
      const test_support::RealtimeGuard guard;
      master_station::ToolState state;
      state.sequence = ++sequence;
      session->remote().send(state);
      (void)session->remote().poll(newest);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(test_support::RealtimeGuard::violations(), before) << test_support::RealtimeGuard::first_violation();
}

/// A relay between both ends, on a thread of its own.
class Link {
 public:
  Link(const transport::Address& slave, const std::string& spec)
      : relay_(transport::Relay::open({transport::loopback(), slave, transport::parse_link_spec(spec).value(), 1})
                   .value()),
        thread_([this] { relay_->run(stop_, std::numeric_limits<std::int64_t>::max()); }) {}
  ~Link() {
    stop_.store(true);
    thread_.join();
  }
  const transport::Address& local() const { return relay_->local(); }

 private:
  std::unique_ptr<transport::Relay> relay_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST(Session, LivesOverALossyDisorderedLinkAndCountsWhatHappened) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback());
  const Link link(remote->local(), "rtt=30ms jitter=3ms loss=5%,burst=3 reorder=3% duplicate=3%");
  const auto session = master(link.local());
  std::uint32_t sequence = 0;
  master_station::LinkReport report;
  const auto is_told = [&] {
    return report.up.lost > 0 && report.up.late > 0 && report.up.duplicate > 0 && report.down.lost > 0 &&
           report.down.late > 0 && report.down.duplicate > 0;
  };
  const auto until = std::chrono::steady_clock::now() + kPatience;
  do {
    ASSERT_TRUE(feels(*session, sequence));
    report = session->report();
  } while (!is_told() && std::chrono::steady_clock::now() < until);
  EXPECT_TRUE(is_told());
  EXPECT_EQ(report.sessions, 1u);
  EXPECT_EQ(report.malformed, 0u);
  // The slave's computing is taken out, so the median is the link's, give or take this machine's hurry.
  EXPECT_GE(report.round_trip.p50_ms, 27.0);
}

}  // namespace
}  // namespace farfeel::end_to_end
