#include "tests/bench/wire_error.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>

#include "codecs/wire/answer_message.h"
#include "codecs/wire/pose_message.h"
#include "haptic_core/geometry/triangle_mesh.h"
#include "haptic_core/tool/rigid_tool.h"
#include "tests/bench/benchmark_scenes.h"
#include "tests/bench/stroked_scenes.h"
#include "tests/bench/strokes.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {
namespace {

using support::quantile;

using contact_service::ContactService;
using contact_service::ToolPose;
using spatial::Vector6;

constexpr double kTick_s = 1e-3;
constexpr std::int64_t kTick_us = 1000;

double now_ns() {
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

WireShares shares(std::vector<double>& errors) {
  return {quantile(errors, 0.5), quantile(errors, 0.99), quantile(errors, 0.999), quantile(errors, 1)};
}

/// A local model at the motion's poses, to which sets come a round trip late.
class Feeler {
 public:
  explicit Feeler(const WireSetting& setting) : delay_(static_cast<std::size_t>(setting.round_trip_ticks)) {
    local_model::LocalModelSettings settings;
    settings.rung = setting.rung;
    model_.emplace(settings);
  }
  void answer(const contact::ContactSet& set) { under_way_.push_back(set); }
  /// What is felt in this tick, and the step to the next pose.
  Vector6 tick(const ToolPose& pose, const ToolPose& next) {
    model_->advance(kTick_s, pose.X_WT);
    if (under_way_.size() > delay_) {
      model_->update(under_way_.front(), pose.X_WT, kTick_s * static_cast<double>(delay_));
      under_way_.pop_front();
    }
    const local_model::Felt felt = model_->evaluate(pose.X_WT, pose.V_WT_W, kTick_s);
    const Vector6 V = spatial::to_vector6(next.V_WT_W);
    const tool::StepWork step{.V_moved = V, .V_change = Vector6::Zero(), .share = 1, .kinetic_J = 0};
    model_->settle(tool::applied_wrench(felt.response, step, kTick_s), V, kTick_s, next.X_WT);
    return felt.response.F_To_W;
  }

 private:
  std::size_t delay_;
  std::optional<local_model::LocalModel> model_;
  std::deque<contact::ContactSet> under_way_;
};

std::vector<ToolPose> with_velocities(const std::vector<spatial::Pose>& motion) {
  std::vector<ToolPose> poses(motion.size());
  for (std::size_t i = 0; i < motion.size(); ++i) {
    poses[i].sequence = static_cast<std::uint32_t>(i);
    poses[i].time_ns = 1000 * kTick_us * static_cast<std::int64_t>(i);
    poses[i].X_WT = motion[i];
    if (i == 0) continue;
    const spatial::Pose& last = motion[i - 1];
    poses[i].V_WT_W = {spatial::vector_from_rotation(glm::normalize(motion[i].R * glm::conjugate(last.R))) / kTick_s,
                       (motion[i].p - last.p) / kTick_s};
  }
  return poses;
}

/// Both ends of a lane that loses nothing; what is heard is so a round trip late.
class Lane {
 public:
  Lane(const codecs::PoseGrid& grid, int round_trip_ticks) : round_trip_ticks_(round_trip_ticks) {
    sent_.reset(grid);
    writer_.reset(grid);
  }
  codecs::PoseMessage pose(const ToolPose& pose, const Vector6& felt) {
    codecs::PoseMessage m, asked;
    m.sequence = pose.sequence;
    m.time_us = pose.time_ns / 1000;
    m.X_WT = pose.X_WT;
    m.V_WT_W = pose.V_WT_W;
    m.felt_To_W = spatial::wrench_from(felt);
    m.heard = reader_.heard(sent_);
    const double began = now_ns();
    pose_bytes = sent_.write(m, bytes_);
    const double written = now_ns();
    const codecs::Fault fault = codecs::read(std::span(bytes_).first(pose_bytes), sent_.grid(), asked);
    pose_write_ns.push_back(written - began);
    pose_read_ns.push_back(now_ns() - written);
    if (fault != codecs::Fault::kNone) throw std::runtime_error("a pose was refused");
    heard_.push_back(asked.heard);
    if (heard_.size() > static_cast<std::size_t>(round_trip_ticks_)) {
      writer_.acknowledge(heard_.front());
      heard_.pop_front();
    }
    return asked;
  }
  const contact::ContactSet& answer(const contact::ContactSet& set, const codecs::PoseMessage& asked) {
    codecs::AnswerMessage m;
    m.set = set;
    m.set.pose_sequence = asked.number;
    const double began = now_ns();
    answer_bytes = writer_.write(m, asked.X_WT, bytes_);
    const double written = now_ns();
    const codecs::Fault fault = reader_.read(std::span(bytes_).first(answer_bytes), sent_, back_);
    answer_write_ns.push_back(written - began);
    answer_read_ns.push_back(now_ns() - written);
    if (fault != codecs::Fault::kNone) throw std::runtime_error("an answer was refused");
    return back_.set;
  }
  std::vector<double> pose_write_ns, pose_read_ns, answer_write_ns, answer_read_ns;
  std::size_t pose_bytes = 0, answer_bytes = 0;

 private:
  int round_trip_ticks_;
  codecs::PoseWriter sent_;
  codecs::AnswerWriter writer_;
  codecs::AnswerReader reader_;
  codecs::AnswerMessage back_;
  std::deque<std::optional<std::uint16_t>> heard_;
  std::array<std::byte, 1199> bytes_{};
};

double force_of(const Vector6& F) {
  return F.tail<3>().norm();
}
double torque_of(const Vector6& F) {
  return F.head<3>().norm() / kWireLever_m;
}

}  // namespace

WireError wire_error(const WireScene& scene, const WireSetting& setting) {
  const std::vector<ToolPose> poses = with_velocities(scene.motion);
  glm::dvec3 low = scene.motion.front().p, high = low;
  for (const spatial::Pose& X : scene.motion) low = glm::min(low, X.p), high = glm::max(high, X.p);
  const codecs::PoseGrid grid = codecs::grid_around(low, high);
  const bool wants_curvature = setting.rung == local_model::Rung::kQuadratic;

  ContactService service = scene.service(), exact_service = scene.service();
  Lane lane(grid, setting.round_trip_ticks);
  Feeler full(setting), told(setting), exact(setting);
  WireError result;
  std::vector<double> force, torque, with_poses;
  Vector6 felt = Vector6::Zero();
  std::size_t sevens = 0;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    const codecs::PoseMessage asked = lane.pose(poses[i], felt);
    const contact::ContactSet& set =
        service.answer({poses[i].sequence, poses[i].time_ns, asked.X_WT, asked.V_WT_W, wants_curvature});
    full.answer(set);
    told.answer(lane.answer(set, asked));
    const Vector6 F_full = full.tick(poses[i], poses[i + 1]);
    felt = told.tick(poses[i], poses[i + 1]);
    if (setting.has_exact_poses) {
      ToolPose exact_pose = poses[i];
      exact_pose.wants_curvature = wants_curvature;
      exact.answer(exact_service.answer(exact_pose));
      const Vector6 F_exact = exact.tick(poses[i], poses[i + 1]);
      if (force_of(F_exact) > 0)
        with_poses.push_back(force_of(felt - F_exact) / std::max(force_of(F_exact), kWireLeast_N));
    }
    ++result.ticks;
    result.contacts_mean += set.count;
    result.contacts_most = std::max(result.contacts_most, set.count);
    result.answer_bytes_mean += static_cast<double>(lane.answer_bytes);
    result.answer_bytes_most = std::max(result.answer_bytes_most, lane.answer_bytes);
    const std::size_t known =
        codecs::kAnswerBlockBytes + set.count * (codecs::kContactBytes + (wants_curvature ? codecs::kCurvedBytes : 0));
    if (lane.answer_bytes > known) result.told_bytes_mean += static_cast<double>(lane.answer_bytes - known);
    if (set.count == 7) result.by_seven_bytes += static_cast<double>(lane.answer_bytes), ++sevens;
    if (force_of(F_full) == 0 && force_of(felt) == 0) continue;
    ++result.touching;
    force.push_back(force_of(felt - F_full) / std::max(force_of(F_full), kWireLeast_N));
    torque.push_back(torque_of(felt - F_full) / std::max({torque_of(F_full), force_of(F_full), kWireLeast_N}));
  }
  const auto ticks = static_cast<double>(result.ticks);
  result.contacts_mean /= ticks;
  result.answer_bytes_mean /= ticks;
  result.told_bytes_mean /= ticks;
  if (sevens > 0) result.by_seven_bytes /= static_cast<double>(sevens);
  result.pose_bytes = static_cast<double>(lane.pose_bytes);
  result.force = shares(force);
  result.torque = shares(torque);
  result.with_poses = shares(with_poses);
  result.pose_write_ns = quantile(lane.pose_write_ns, 0.5);
  result.pose_read_ns = quantile(lane.pose_read_ns, 0.5);
  result.answer_write_ns = quantile(lane.answer_write_ns, 0.5);
  result.answer_read_ns = quantile(lane.answer_read_ns, 0.5);
  return result;
}

WireScene wire_scene(const std::string& name, std::uint64_t seed, std::size_t frames) {
  for (auto& stroked : stroked_scenes(name == "ridges" ? SceneChoice::kAll : SceneChoice::kOne)) {
    if (stroked->name() != name) continue;
    const std::shared_ptr<StrokedScene> scene = std::move(stroked);
    const StrokePath path(strokes_of_every_speed(), -0.015);
    const double phase_s = static_cast<double>(seed % 7);
    std::vector<spatial::Pose> motion(frames);
    for (std::size_t i = 0; i < frames; ++i) {
      const double t_s = kTick_s * static_cast<double>(i);
      const double press_m = 3e-4 + 2e-4 * std::sin(3 * t_s + phase_s);
      motion[i] = scene->X_WT(path.at_m(t_s), 1e-3 * std::sin(t_s), 0.1 * std::sin(1.3 * t_s), press_m);
    }
    return {name, motion, [scene] { return scene->service(contact::Material{}); }};
  }
  const auto scene = std::make_shared<BenchmarkScene>(benchmark_scene(name));
  return {name, scene->motion(seed, frames), [scene] {
            const contact_service::TouchableObject S{&scene->object.felt, scene->object.material, {}},
                T{&scene->tool.felt, scene->tool.material, {}};
            return ContactService(
                {&S, 1}, T,
                {.tolerance_m = scene->tolerance_m, .most_stiffness_N_per_m = contact_service::kHeldStiffness_N_per_m});
          }};
}

}  // namespace farfeel::bench
