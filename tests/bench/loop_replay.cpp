#include "tests/bench/loop_replay.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "codecs/tile/tile_codec.h"
#include "codecs/wire/tile_messages.h"
#include "haptic_core/tool/rigid_tool.h"

namespace farfeel::bench {
namespace {

using contact_service::ToolPose;
using local_model::Rung;
using spatial::Vector6;

constexpr double kPress_m = 0.6e-3;
constexpr double kSettle_s = 0.3;  // and three round trips: the first tiles arrive, what was let in is in

/// What the loop's step would have done had it moved the tool as the hand moves.
tool::StepWork step_between(const ToolPose& before, const ToolPose& after, double dt_s) {
  const spatial::Twist moved{
      spatial::vector_from_rotation(glm::normalize(after.X_WT.R * glm::conjugate(before.X_WT.R))) / dt_s,
      (after.X_WT.p - before.X_WT.p) / dt_s};
  return {.V_moved = spatial::to_vector6(moved),
          .V_change = spatial::to_vector6(after.V_WT_W) - spatial::to_vector6(before.V_WT_W),
          .share = 1,
          .kinetic_J = 0};
}

}  // namespace

ReplayTruth::ReplayTruth(const StrokedScene& scene, std::vector<Stroke> strokes, double start_m)
    : scene_(scene), path_(strokes, start_m) {
  contact_service::ContactService service = scene.service(kWithoutLoss);
  const auto count = static_cast<std::size_t>(length_s() * kTruth_hz);
  Vector6 sum = Vector6::Zero(), squares = sum;
  for (std::size_t i = 0; i < count; ++i) {
    ToolPose amid = hand(middle_s(i), static_cast<std::uint32_t>(i));
    amid.wants_curvature = true;  // summed in steps fine enough for second derivatives: no noise of the loop's own sums
    wrenches_.push_back(spatial::to_vector6(service.answer(amid).F_To_W));
    sum += wrenches_.back();
    squares += wrenches_.back().cwiseAbs2();
  }
  const Vector6 variance = squares / static_cast<double>(count) - (sum / static_cast<double>(count)).cwiseAbs2();
  torque_variance_ = variance.head<3>().sum();
  force_variance_ = variance.tail<3>().sum();
  mean_force_N_ = (sum / static_cast<double>(count)).tail<3>().norm();
}

/// A slow sway across the stroke and a little turning go with it.
spatial::Pose ReplayTruth::X_WT(double t_s) const {
  const double along_m = path_.at_m(t_s), way = along_m / 5e-3;
  return scene_.X_WT(along_m, 1.5e-3 * std::sin(0.7 * way + 0.3 + 2 * std::max(0.0, t_s)), 0.1 * std::sin(0.4 * way),
                     kPress_m);
}

ToolPose ReplayTruth::hand(double t_s, std::uint32_t sequence) const {
  constexpr double h = 1e-5;
  const spatial::Pose a = X_WT(t_s - h), X = X_WT(t_s), b = X_WT(t_s + h);
  const glm::dvec3 w = spatial::vector_from_rotation(glm::normalize(b.R * glm::conjugate(a.R))) / (2 * h);
  return {sequence, std::llround(1e9 * (t_s + 10)), X, {w, (b.p - a.p) / (2 * h)}};
}

Replayed replay(const ReplayTruth& truth, Rung rung, double tick_hz, const transport::LinkSpec& link,
                const RemoteAcrossLink::Options& options) {
  RemoteAcrossLink remote(truth.scene(), kWithoutLoss, link, options);
  local_model::LocalContacts* local = remote.contacts();
  local_model::LocalModelSettings settings;
  settings.rung = rung;
  local_model::LocalModel model(settings);

  const double dt_s = 1 / tick_hz, settle_s = kSettle_s + 3e-9 * static_cast<double>(link.round_trip_ns);
  const auto first = -std::lround(settle_s * tick_hz), last = std::lround(truth.length_s() * tick_hz);
  Replayed result;
  Vector6 errors = Vector6::Zero();
  contact::ContactSet newest;
  std::size_t compared = 0;
  std::uint64_t contact_bytes = 0, tile_bytes = 0;
  long late = 0;
  for (long i = first; i < last; ++i) {
    const double t_s = static_cast<double>(i) * dt_s;
    const ToolPose hand = truth.hand(t_s, static_cast<std::uint32_t>(i - first + 1));
    if (i == 0) contact_bytes = remote.contact_bytes(), tile_bytes = remote.tile_bytes();
    remote.at(hand.time_ns);
    model.advance(dt_s, hand.X_WT);
    if (remote.poll(newest)) {
      if (local) {
        local->hear(newest);
        model.hear(newest);
      } else {
        model.update(newest, hand.X_WT, 1e-9 * static_cast<double>(hand.time_ns - newest.pose_time_ns));
      }
    }
    if (local) {
      const double ahead_s = model.ahead_s(hand.X_WT, hand.V_WT_W, dt_s);
      const local_model::TickContacts& here =
          rung == Rung::kTiles ? local->ahead_of(hand, ahead_s) : local->beside_remote_ahead_of(hand, ahead_s);
      model.refresh(here, hand.X_WT);
      late += i >= 0 && here.lacking > 0;
    }
    const ToolPose next = truth.hand(t_s + dt_s, 0);
    const tool::StepWork step = step_between(hand, next, dt_s);
    const Vector6 felt = tool::applied_wrench(model.evaluate(hand.X_WT, hand.V_WT_W, dt_s).response, step, dt_s);
    model.settle(felt, step.V_moved, dt_s, next.X_WT);
    remote.send({hand.sequence, hand.time_ns, hand.X_WT, hand.V_WT_W});
    if (i < 0) continue;
    for (; compared < truth.wrenches().size() && ReplayTruth::middle_s(compared) < t_s + dt_s; ++compared)
      errors += (felt - truth.wrenches()[compared]).cwiseAbs2();
  }
  const auto n = static_cast<double>(compared);
  result.force_share = std::sqrt(errors.tail<3>().sum() / n / truth.force_variance());
  result.torque_share = std::sqrt(errors.head<3>().sum() / n / truth.torque_variance());
  result.arm_off_m = std::sqrt(errors.head<3>().sum() / n) / truth.mean_force_N();
  result.truth_arm_m = truth.arm_m();
  result.contact_kB_s = 1e-3 * static_cast<double>(remote.contact_bytes() - contact_bytes) / truth.length_s();
  result.tile_kB_s = 1e-3 * static_cast<double>(remote.tile_bytes() - tile_bytes) / truth.length_s();
  result.outline_kB = 1e-3 * static_cast<double>(remote.outline_bytes());
  result.all_tile_kB = 1e-3 * static_cast<double>(remote.tile_bytes());
  result.late_share = static_cast<double>(late) / static_cast<double>(last);
  result.late_ticks = late;
  return result;
}

std::uint64_t oracle_tile_bytes(const ReplayTruth& truth) {
  constexpr double kTick_s = 1e-3;
  contact_service::ContactService scout = truth.scene().service(kWithoutLoss);
  std::set<std::pair<std::uint32_t, std::uint32_t>> needed;
  for (std::uint32_t i = 0; i * kTick_s < truth.length_s(); ++i) {
    scout.restart();
    for (const contact_service::SurfaceTile& where : scout.tiles_needed(truth.hand(i * kTick_s, i), 0).tiles)
      needed.insert({where.surface, where.tile});
  }
  std::uint64_t bytes = 0;
  std::vector<std::byte> message(transport::kMostMessageBytes);
  for (const auto& [surface, tile] : needed) {
    const geometry::HapticSurface& of = truth.scene().surface(surface);
    for (const auto& part : codecs::encoded_tile(tile, of.tiles[tile], codecs::nearness(of), 0))
      bytes += codecs::write(codecs::TileMessage{surface, part}, message);
  }
  return bytes;
}

}  // namespace farfeel::bench
