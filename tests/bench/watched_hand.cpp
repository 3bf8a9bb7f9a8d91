#include "tests/bench/watched_hand.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/guarded_rig.h"

namespace farfeel::bench {
namespace {

using devices::DeviceModel;
using devices::Enabling;
using master_station::Grip;

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr double kTick_s = 1e-3;
constexpr Grip kLimpGrip{"limp", 20, 0.5, 0.05, 0.001, 0.01};
constexpr std::array kGrips{kLimpGrip, master_station::kSoftGrip, master_station::kMediumGrip,
                            master_station::kHardGrip};
constexpr double kTouch_N = 0.3;

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
  }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }
  bool one_in(std::size_t n) { return below(n) == 0; }

 private:
  std::mt19937_64 random_;
};

/// Every model that gives force.
const std::vector<DeviceModel>& felt_models() {
  static const std::vector<DeviceModel> models = [] {
    std::vector<DeviceModel> found;
    for (const std::string& name : devices::model_names())
      if (const DeviceModel& model = *devices::find_model(name); model.force_dof > 0) found.push_back(model);
    return found;
  }();
  return models;
}

/// How a hand comes to a surface and what it does there. Along the surface's normal n, and a direction u across.
struct HandMotion {
  enum class Kind { kPress, kStrike, kShake, kLetGo, kRub, kPoke, kPullBack };
  static constexpr std::array<std::string_view, 7> kNames{"presses", "strikes", "shakes",    "lets go",
                                                          "rubs",    "pokes",   "pulls back"};
  Kind kind;
  double begin_s, height_m, speed_m_s, press_m;  ///< from that height, at that speed, to that far below the surface
  double shake_Hz, shake_m, rub_m_s;
  glm::dvec3 shake_along_W;
  double leaves_s;  ///< after it arrived: lets go, or pulls back
  double plays_s;   ///< so long it rubs, or shakes

  [[nodiscard]] double arrives_s() const { return begin_s + (height_m + press_m) / speed_m_s; }
  /// Where it wants the tool's point, the surface at z = 0.
  [[nodiscard]] glm::dvec3 at(double t_s) const {
    // A poke speeds up from rest; all others move evenly.
    double down_m = speed_m_s * (t_s - begin_s);
    if (kind == Kind::kPoke) down_m = 0.5 * 10 * speed_m_s * std::pow(std::max(0.0, t_s - begin_s), 2);
    down_m = std::clamp(down_m, 0.0, height_m + press_m);
    glm::dvec3 p{0, 0, height_m - down_m};
    if (kind == Kind::kPullBack && t_s > arrives_s() + leaves_s)
      p.z = std::min(height_m, p.z + speed_m_s * (t_s - arrives_s() - leaves_s));
    const double played_s = std::clamp(t_s - begin_s, 0.0, plays_s);
    if (kind == Kind::kRub) p.x += 0.02 * std::sin(rub_m_s / 0.02 * played_s);
    const double shaken_s = kind == Kind::kShake ? played_s : t_s;
    p += shake_m * std::sin(2 * std::numbers::pi * shake_Hz * shaken_s) * shake_along_W;
    return p;
  }
};

HandMotion drawn_motion(Draw& draw, double stiffness_N_per_m, double most_N, double reach_m) {
  HandMotion m{};
  m.kind = static_cast<HandMotion::Kind>(draw.below(HandMotion::kNames.size()));
  using Kind = HandMotion::Kind;
  const bool is_fast = m.kind == Kind::kStrike;
  m.begin_s = draw.uniform(0.1, 3.5);
  m.height_m = m.kind == Kind::kPoke ? draw.uniform(0, 0.003) : draw.uniform(0.005, 0.6 * reach_m);
  m.speed_m_s = is_fast ? draw.uniform(0.3, 1.0) : draw.uniform(0.02, 0.2);
  m.press_m = std::min(draw.uniform(0.5, 1.2 * most_N) / stiffness_N_per_m, 0.35 * reach_m + 0.005);
  m.leaves_s = draw.uniform(0, 0.2);
  m.plays_s = draw.uniform(0.5, 4);
  m.rub_m_s = draw.uniform(0.05, 0.3);
  // Every hand trembles; one in seven shakes on purpose, as fast as people can.
  const bool shakes = m.kind == Kind::kShake;
  m.shake_Hz = shakes ? draw.uniform(1, 8) : draw.uniform(6, 12);
  m.shake_m = shakes ? std::min(draw.uniform(0.002, 0.015), 8.0 / std::pow(2 * std::numbers::pi * m.shake_Hz, 2))
                     : draw.uniform(0, 1e-4);
  const double z = draw.uniform(-1, 1), angle = draw.uniform(0, 2 * std::numbers::pi);
  m.shake_along_W = {std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z};
  return m;
}

/// Turns the device so that its own axis points up, out of the surface.
glm::dquat base_turned_up(int axis) {
  const double third = 2 * std::numbers::pi / 3;
  const glm::dvec3 diagonal = glm::normalize(glm::dvec3(1));
  return axis == 2 ? glm::dquat{1, 0, 0, 0} : glm::angleAxis(axis == 0 ? -third : third, diagonal);
}

/// Device axes that stand for another, or for their own other way; the touched one among them.
glm::dmat3 drawn_wiring(Draw& draw, int axes, int touched) {
  for (;;) {
    std::array<int, 3> order{0, 1, 2};
    for (int i = axes - 1; i > 0; --i)
      std::swap(order[static_cast<std::size_t>(i)], order[draw.below(static_cast<std::size_t>(i) + 1)]);
    glm::dmat3 wiring(0);
    for (int i = 0; i < 3; ++i) wiring[i][order[static_cast<std::size_t>(i)]] = i < axes && draw.one_in(2) ? -1 : 1;
    if (wiring[touched][touched] != 1) return wiring;
  }
}

}  // namespace

WatchedOutcome watch(const WatchedCase& chosen) {
  Draw draw(chosen.seed);
  const DeviceModel& model = felt_models()[draw.below(felt_models().size())];
  const Grip& grip = kGrips[draw.below(chosen.is_miswired ? kGrips.size() - 1 : kGrips.size())];
  const double surface_N_per_m = draw.log_uniform(50, 20000);
  const int touched = static_cast<int>(draw.below(static_cast<std::size_t>(model.force_dof)));

  devices::GuardSettings guard;
  guard.is_new_device = chosen.is_new_device;
  const glm::dquat R_WB = base_turned_up(touched);
  const double reach_m = 0.5 * (model.workspace_max_B_m[touched] - model.workspace_min_B_m[touched]);
  const double most_N = std::min(model.max_force_N, 6.0);
  HandMotion hand = drawn_motion(draw, grip.stiffness_N_per_m, most_N, std::min(reach_m, 0.05));
  if (chosen.disturbance != Disturbance::kNone || !chosen.is_new_device) hand.begin_s = draw.uniform(0.1, 0.5);
  const double event_s = hand.arrives_s() + draw.uniform(-0.1, 0.6);
  const double moves_s = draw.log_uniform(0.01, 1), moves_m = draw.uniform(-0.03, 0.03);
  const bool object_moves = chosen.disturbance == Disturbance::kObjectMoves;
  const std::array keys{motion::Keyframe{0, {}}, motion::Keyframe{std::max(event_s, 0.05), {}},
                        motion::Keyframe{std::max(event_s, 0.05) + moves_s, {{1, 0, 0, 0}, {0, 0, moves_m}}}};
  const motion::ScriptedMotion script(keys, motion::Afterwards::kStays);
  devices::GuardedRig rig(grip, model, surface_N_per_m, guard, R_WB, object_moves ? &script : nullptr);
  rig.remote.world.points_T = {{0, 0, 0}};
  rig.remote.world.material.stiffness_N_per_m = surface_N_per_m;
  if (chosen.is_miswired) rig.wires.axes = drawn_wiring(draw, model.force_dof, touched);

  const double round_trip_s = draw.one_in(2) ? 0 : draw.uniform(0, 0.1);
  rig.remote.set_link({.round_trip_ns = std::llround(1e9 * round_trip_s)}, chosen.seed);
  rig.remote.answer_period_ns = static_cast<std::int64_t>(1 + draw.below(4)) * kTick_ns;

  const double outage_s = chosen.disturbance == Disturbance::kLinkOutage ? draw.log_uniform(0.02, 2) : 0;
  const double freeze_s = chosen.disturbance == Disturbance::kMachineFreeze ? draw.log_uniform(0.02, 0.5) : 0;
  const int freezes = 1 + static_cast<int>(draw.below(4));

  WatchedOutcome outcome;
  outcome.what = fmt::format("seed {}: {}, {} grip, {}, {:.0f} N/m, along axis {}, round trip {:.0f} ms", chosen.seed,
                             model.name, grip.name, HandMotion::kNames[static_cast<std::size_t>(hand.kind)],
                             surface_N_per_m, touched, 1e3 * round_trip_s);
  const double end_s =
      (chosen.disturbance == Disturbance::kNone ? hand.arrives_s() + 1 : event_s + outage_s + freezes * freeze_s + 2) +
      (chosen.is_miswired ? 10 : 0);
  const double touch_N = std::min(kTouch_N, 0.5 * devices::GuardedDevice::kFirstShare * most_N);
  const auto hold = [&](double t_s) {
    const glm::dvec3 p_W = hand.at(t_s), next_W = hand.at(t_s + kTick_s);
    rig.device.hold_at({{1, 0, 0, 0}, glm::conjugate(R_WB) * p_W},
                       {{0, 0, 0}, glm::conjugate(R_WB) * ((next_W - p_W) / kTick_s)});
  };
  rig.device.start_at({{1, 0, 0, 0}, glm::conjugate(R_WB) * hand.at(0)});
  double most_J = rig.device.actuator_port().energy_J(), touched_s = -1, lost_s = 0;
  int frozen = 0;
  for (double t_s = 0; t_s < end_s; t_s += kTick_s) {
    // The hand lives on through a freeze of the machine.
    const double hand_s = t_s + lost_s;
    hold(hand_s);
    if (hand.kind == HandMotion::Kind::kLetGo && hand_s > hand.arrives_s() + hand.leaves_s)
      rig.device.grip_as(kLimpGrip);
    if (model.enabling == Enabling::kStation && t_s > 0.05) rig.guard.hold_station_key_until(rig.time_ns + 500'000'000);
    rig.remote.is_silent = outage_s > 0 && t_s >= event_s && t_s < event_s + outage_s;
    if (freeze_s > 0 && frozen < freezes && t_s >= event_s + 0.2 * frozen) {
      ++frozen;
      rig.time_ns += std::llround(1e9 * freeze_s);
      lost_s += freeze_s;
    }
    if (object_moves) rig.remote.world.level_m = script.at(t_s + lost_s).X_WO.p.z;
    const master_station::TickRecord record = rig.tick();
    const double force_N = glm::length(record.F_hand_W.force_N);
    if (rig.guard.stage() == devices::Stage::kTrying) outcome.tried_s += kTick_s;
    if (touched_s < 0 && rig.guard.stage() == devices::Stage::kEnabled && force_N >= touch_N) touched_s = t_s;
    const double in_J = rig.device.actuator_port().energy_J();
    most_J = std::max(most_J, in_J);
    outcome.given_J = std::max(outcome.given_J, most_J - in_J);
    const master_station::Fault fault = rig.loop.fault();
    if (outcome.alarm.empty() &&
        (fault == master_station::Fault::kDeviceGivesWork || fault == master_station::Fault::kDeviceGoesElsewhere)) {
      outcome.alarm = fault == master_station::Fault::kDeviceGivesWork ? "gives work" : "goes elsewhere";
      outcome.told_s = touched_s < 0 ? -1 : t_s - touched_s;
      if (chosen.is_miswired) break;
    }
  }
  outcome.is_touched = touched_s >= 0;
  return outcome;
}

}  // namespace farfeel::bench
