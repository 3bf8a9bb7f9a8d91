// The object stands still with its frame on the world's. The hand's intent goes along the place's way in, from as far
// out as is free, to where its grip's spring presses with the wanted force if the surface does not give; then it stays,
// or strokes across.
#include "tests/bench/touch_sessions.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/contact/material.h"
#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "tests/bench/felt_pair.h"
#include "tests/bench/remote_across_link.h"
#include "tests/bench/touch_side.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using spatial::Pose;

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr int kFree_ms = 200, kAfter_ms = 700;
constexpr double kPressSpeed_m_s = 0.1, kStrokeSpeed_m_s = 0.1, kStroke_m = 0.02, kJabSpeed_m_s = 1;
constexpr double kFirmGrip_N = 5;       // from here on the hand holds hard
constexpr double kFeltForce_N = 0.05;   // less is nothing to a hand
constexpr double kLeastPushBack = 0.5;  // of what should push back
constexpr double kSpareForce = 1.2;     // of the device, over the hand

SimulatedDeviceSettings device_settings(const SessionPlan& plan) {
  SimulatedDeviceSettings settings;
  settings.grip = plan.hand_N < kFirmGrip_N ? kMediumGrip : kHardGrip;
  settings.explorer.hints.p_TWork_T = {0, 0, 0};
  settings.model.max_force_N = std::max(settings.model.max_force_N, kSpareForce * plan.hand_N);
  return settings;
}

tool::MassProperties body_of(const codecs::Asset& asset) {
  tool::MassProperties body{.mass_kg = asset.mass_kg};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) body.inertia_To_T(row, column) = asset.inertia_O_kg_m2[column][row];
  return body;
}

/// Where the hand wants the tool, t_s after it set off from start_m outside.
Pose intent(const SessionPlan& plan, double lean_m, double t_s) {
  const double speed_m_s = plan.motion == HandMotion::kJab ? kJabSpeed_m_s : kPressSpeed_m_s;
  const double way_m = plan.place.free_way_m + lean_m, in_s = way_m / speed_m_s;
  Pose X = plan.place.X_OT(std::min(way_m, speed_m_s * std::max(0.0, t_s)) - plan.place.free_way_m);
  if (plan.motion == HandMotion::kStroke) {
    const double along_m = std::clamp(kStrokeSpeed_m_s * (t_s - in_s), 0.0, kStroke_m);
    X.p += along_m * spatial::rotate({spatial::frame_with_z(plan.place.out_O), {}}, {1, 0, 0});
  }
  return X;
}

/// Longest run of ticks that a condition held.
class Longest {
 public:
  void look(bool holds) {
    now_ = holds ? now_ + 1 : 0;
    most_ = std::max(most_, now_);
  }
  [[nodiscard]] int ticks() const { return most_; }

 private:
  int now_ = 0, most_ = 0;
};

}  // namespace

std::string_view name(HandMotion motion) {
  return motion == HandMotion::kPress ? "press" : motion == HandMotion::kStroke ? "stroke" : "jab";
}

SessionFigures run_session(const FeltPair& pair, const TouchSubject& subject, const TouchTool& tool,
                           const SessionPlan& plan, const SessionWitness& witness) {
  const contact::Material material;
  SimulatedDevice device(device_settings(plan));
  RemoteAcrossLink remote(pair, material, plan.link, RemoteAcrossLink::options_of(plan.rung), plan.link_seed);
  HapticLoopSettings settings;
  settings.timing.period_ns = kTick_ns;
  settings.body = body_of(tool.baked.asset);
  settings.local_model.rung = plan.rung;
  settings.local_model.contact = plan.contact;
  const double lean_m = plan.hand_N / device_settings(plan).grip.stiffness_N_per_m;
  const Pose X_start = intent(plan, lean_m, 0);
  settings.X_WB = X_start * spatial::inverse(device.true_pose());  // the handle begins where the tool does
  HapticLoop loop(device, remote, settings, remote.contacts());

  const double stiffness_N_per_m = contact::combined(material, material).stiffness_N_per_m;
  const double limit_N = device.capabilities().max_force_N;
  SideWatch side(subject.truth, X_start.p);
  SessionFigures figures;
  Longest through, without_force;
  bool has_felt = false;
  const int set_off = kFree_ms + static_cast<int>(3 * plan.link.round_trip_ns / kTick_ns);
  const double in_s =
      (plan.place.free_way_m + lean_m) / (plan.motion == HandMotion::kJab ? kJabSpeed_m_s : kPressSpeed_m_s);
  const int end = set_off + static_cast<int>(1e3 * in_s) + kAfter_ms;
  for (int i = 0; i < end; ++i) {
    device.hold_at(spatial::inverse(settings.X_WB) * intent(plan, lean_m, 1e-3 * (i - set_off)));
    remote.at(i * kTick_ns);
    loop.tick({i * kTick_ns, 0, 0, 0});
    TickRecord record;
    loop.records().pop(record);
    const TrueTouch touch = side.move_to(record.X_WT.p, tool.shape.radius_m);
    const WayOut& way = touch.main;
    const double force_N = glm::length(record.F_contact_To_W.force_N);
    through.look(side.is_behind() &&
                 pushed_back_share(touch, record.F_contact_To_W.force_N, stiffness_N_per_m, limit_N) < kLeastPushBack);
    without_force.look(way.depth_m > subject.allowed_m() && force_N < kFeltForce_N);
    figures.deepest_m = std::max(figures.deepest_m, way.depth_m);
    has_felt = has_felt || (way.depth_m > 0 && force_N > kFeltForce_N);
    if (witness) {
      witness({i - set_off, way, record.X_WT.p, record.F_contact_To_W.force_N, glm::length(record.F_hand_W.force_N),
               side.is_behind()});
    }
    if (!has_felt) figures.first_touch_m = std::max(figures.first_touch_m, way.depth_m);
  }
  figures.through_ms = through.ticks(), figures.without_force_ms = without_force.ticks();
  figures.is_behind_at_end = side.is_behind();
  figures.is_fault = loop.fault() != Fault::kNone;
  return figures;
}

}  // namespace farfeel::bench
