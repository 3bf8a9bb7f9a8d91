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
  const contact::ContactSet& answer(const contact_service::ToolPose& pose) noexcept override {
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
  contact::ContactSet set_;
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

inline std::unique_ptr<SlaveSession> slave(slave_sim::ContactSource& contacts, const transport::Address& local,
                                           std::vector<std::byte> blob = scene()) {
  auto result = SlaveSession::start({local, {}}, std::move(blob), contacts);
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

inline std::unique_ptr<MasterSession> master(const transport::Address& to) {
  auto result = MasterSession::connect({to, 20, {}});
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
      EXPECT_FLOAT_EQ(static_cast<float>(newest.contacts[0].depth_m), static_cast<float>(1e-3 * newest.pose_sequence));
      return true;
    }
  }
  return false;
}

}  // namespace farfeel::end_to_end
