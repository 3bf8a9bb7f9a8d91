// A slave that feels a floor, a master to feel it with, and patience.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "master_station/session/master_session.h"
#include "slave_sim/session/slave_session.h"

namespace farfeel::end_to_end {

using master_station::MasterSession;
using slave_sim::SlaveSession;

inline constexpr auto kPatience = std::chrono::seconds(20);  // far more than anything here takes; not a measurement

/// One contact under the tool, as deep as the tool is below the floor's level.
class Floor final : public slave_sim::ContactSource {
 public:
  const contact_service::Answer& answer(const contact_service::ToolPose& pose) noexcept override {
    set_ = {};
    set_.pose_sequence = pose.sequence;
    set_.pose_time_ns = pose.time_ns;
    set_.X_WT = pose.X_WT;
    set_.count = 1;
    set_.contacts[0].nhat_ST_W = {0, 0, 1};
    set_.contacts[0].p_WC_W = pose.X_WT.p;
    set_.contacts[0].depth_m = level_m - pose.X_WT.p.z;
    return set_;
  }
  void restart() noexcept override { ++restarts; }
  void edit(const slave_sim::SurfaceEdit&) noexcept override { ++edits; }
  std::atomic<int> restarts{0}, edits{0};
  std::atomic<double> level_m{0};

 private:
  contact_service::Answer set_;
};

inline geometry::TriangleMesh tetrahedron(double size_m) {
  return {{{0, 0, 0}, {size_m, 0, 0}, {0, size_m, 0}, {0, 0, size_m}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

inline std::vector<std::byte> scene(double size_m = 0.1) {
  codecs::SceneDescription description;
  description.name = "test";
  description.objects = {{"rock", {}, tetrahedron(size_m)}};
  description.tool.name = "needle";
  description.tool.visible_T = tetrahedron(0.02);
  description.tool.mass_kg = 0.1;
  description.tool.inertia_To_T_kg_m2 = glm::dmat3(1e-5);
  return codecs::write_scene(description).value();
}

/// The same in every process of a test.
inline transport::KeyPair key_of(std::uint8_t who) {
  transport::Key32 secret;
  secret.fill(static_cast<std::byte>(who));
  return transport::key_pair_of(secret);
}

inline transport::Greeter greeter(std::uint8_t who = 1) {
  transport::Greeter greeter;
  greeter.own = key_of(who);
  greeter.slave = key_of(100).public_key;
  greeter.master = transport::random_identity();
  greeter.wall_clock_ns = transport::wall_clock_ns;
  greeter.next_counter = [last = std::uint64_t{0}]() mutable {
    const auto clock = std::chrono::system_clock::now().time_since_epoch();
    return last = std::max(last + 1, static_cast<std::uint64_t>(std::chrono::nanoseconds(clock).count()));
  };
  return greeter;
}

/// Operators 1 and 2 may in.
inline std::optional<transport::Operator> allowed(const transport::Key32& key) {
  for (const auto who : {std::uint8_t{1}, std::uint8_t{2}}) {
    if (key == key_of(who).public_key) return transport::Operator{"operator " + std::to_string(who), {}, false};
  }
  return std::nullopt;
}

inline SlaveSession::Options slave_options(const transport::Address& local) {
  SlaveSession::Options options;
  options.local = local;
  options.own = key_of(100);
  options.find = allowed;
  return options;
}

inline std::unique_ptr<SlaveSession> slave(slave_sim::ContactSource& contacts, const transport::Address& local,
                                           std::vector<std::byte> blob = scene()) {
  auto result = SlaveSession::start(slave_options(local), std::move(blob), contacts);
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

inline MasterSession::Options master_options(const transport::Address& to, double patience_s = 20) {
  return {{to}, greeter(), patience_s, {}, {}};
}

inline std::unique_ptr<MasterSession> master(const transport::Address& to) {
  auto result = MasterSession::connect(master_options(to));
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

/// Ticks the haptic lane at about 1 kHz until contacts at least as new as `sequence` have come.
inline bool feels(MasterSession& session, std::uint32_t& sequence) {
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
      EXPECT_NEAR(newest.contacts[0].depth_m, 1e-3 * newest.pose_sequence,
                  1e-6 + 2e-5 * newest.contacts[0].depth_m);  // as the wire tells poses and depths
      return true;
    }
  }
  return false;
}

}  // namespace farfeel::end_to_end
