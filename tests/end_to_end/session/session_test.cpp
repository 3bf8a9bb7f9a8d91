// Both ends of a session in one process, over real loopback sockets.

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "master_station/session/master_session.h"
#include "slave_sim/session/slave_session.h"

namespace farfeel {
namespace {

using master_station::MasterSession;
using slave_sim::SlaveSession;

constexpr auto kPatience = std::chrono::seconds(20);  // far more than anything here takes; not a measurement

/// One contact under the tool, as deep as the tool is low.
class Floor final : public slave_sim::ContactSource {
 public:
  const contact::ContactSet& answer(const slave_sim::ToolPose& pose) noexcept override {
    set_ = {};
    set_.pose_sequence = pose.sequence;
    set_.pose_time_ns = pose.time_ns;
    set_.X_WT = pose.X_WT;
    set_.count = 1;
    set_.contacts[0].nhat_ST_W = {0, 0, 1};
    set_.contacts[0].p_WC_W = pose.X_WT.p;
    set_.contacts[0].depth_m = -pose.X_WT.p.z;
    return set_;
  }
  void restart() noexcept override { ++restarts; }
  std::atomic<int> restarts{0};

 private:
  contact::ContactSet set_;
};

geometry::TriangleMesh tetrahedron(double size_m) {
  return {{{0, 0, 0}, {size_m, 0, 0}, {0, size_m, 0}, {0, 0, size_m}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

std::vector<std::byte> scene(double size_m = 0.1) {
  codecs::SceneDescription description;
  description.name = "test";
  description.objects = {{"rock", {}, tetrahedron(size_m)}};
  description.tool.name = "needle";
  description.tool.visible_T = tetrahedron(0.02);
  description.tool.mass_kg = 0.1;
  description.tool.inertia_To_T_kg_m2 = glm::dmat3(1e-5);
  return codecs::write_scene(description).value();
}

std::unique_ptr<SlaveSession> slave(slave_sim::ContactSource& contacts, const transport::Address& local,
                                    std::vector<std::byte> blob = scene()) {
  auto result = SlaveSession::start({local, {}}, std::move(blob), contacts);
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

std::unique_ptr<MasterSession> master(const transport::Address& to) {
  auto result = MasterSession::connect({to, 20, {}});
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

/// Ticks the haptic lane at about 1 kHz until contacts at least as new as `sequence` have come.
bool feels(MasterSession& session, std::uint32_t& sequence) {
  const std::uint32_t first = sequence + 1;
  contact::ContactSet newest;
  for (const auto until = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < until;) {
    master_station::ToolState state;
    state.sequence = ++sequence;
    state.time_ns = transport::monotonic_ns();
    state.X_WT.p = {0, 0, -1e-3 * sequence};
    session.remote().send(state);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (session.remote().poll(newest) && newest.pose_sequence >= first) {
      EXPECT_EQ(newest.count, 1u);
      EXPECT_FLOAT_EQ(static_cast<float>(newest.contacts[0].depth_m), static_cast<float>(1e-3 * newest.pose_sequence));
      return true;
    }
  }
  return false;
}

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

TEST(Session, SpeaksIpv6) {
  Floor floor;
  const auto remote = slave(floor, transport::loopback(true));
  const auto session = master(remote->local());
  std::uint32_t sequence = 0;
  EXPECT_TRUE(feels(*session, sequence));
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
  const auto second =
      MasterSession::connect({remote->local(), 0.5, [&](const std::string& doing, double) { last = doing; }});
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another master"), std::string::npos) << second.error().message;
  EXPECT_NE(last.find("another master"), std::string::npos) << last;
}

TEST(Session, SaysThatNobodyAnswers) {
  const auto nobody = transport::UdpSocket::open_pair(transport::loopback()).value()[0].local();
  const auto session = MasterSession::connect({nobody, 0.2, {}});
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().kind, transport::ErrorKind::kTimeout);
}

TEST(Session, IsUnmovedByJunkOnBothOfTheSlavesPorts) {
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
    // Every other one gets as far as it can without knowing the session.
    if (i % 2 == 0)
      (void)transport::write_packet({static_cast<transport::PacketType>(random % 20), random, random >> 16},
                                    std::span(junk).subspan(16, random % 1185), junk);
    const auto size = std::span(junk).first(i % 2 == 0 ? 16 + random % 1185 : random % 1201);
    hostile.send_to(remote->local().with_port(static_cast<std::uint16_t>(remote->local().port + i % 4 / 2)), size);
  }
  EXPECT_TRUE(feels(*session, sequence));
  const auto report = session->report();
  EXPECT_EQ(report.sessions, 1u);
  EXPECT_EQ(floor.restarts.load(), 1);
}

}  // namespace
}  // namespace farfeel
