#include "tests/bench/device_stability.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "master_station/devices/simulated_device.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using devices::DeviceModel;

constexpr std::int64_t kTick_ns = 1'000'000;
constexpr int kKickTicks = 5;
constexpr double kLeastJudged_s = 0.5;  // the first so much, and the last: a swing at least
constexpr double kJudgings = 6;         // of that in all
constexpr double kKick_N = 2, kKick_Nm = 0.05;
// From the first part to the last. A heavy handle with little friction and no hand takes many swings to come to rest,
// however soft the spring is: what goes down is calm.
constexpr double kDecays = 0.9;
constexpr double kGone = 10;  // m or rad: it ran away
constexpr double kCounts = 3;
constexpr Grip kNoHand{"none", 0, 0, 0, 0, 0};

/// As it is but for what hides the limit: friction at rest, the actuators' limit, and no hand.
SimulatedDeviceSettings bare(const DeviceModel& model, bool is_counted) {
  SimulatedDeviceSettings settings;
  settings.model = model;
  settings.model.coulomb_friction_N = settings.model.coulomb_friction_Nm = 0;
  settings.model.max_force_N = settings.model.max_torque_Nm = 1e6;
  if (!is_counted) settings.model.position_step_m = settings.model.rotation_step_rad = 0;
  settings.grip = kNoHand;
  return settings;
}

bool decays(const DeviceModel& model, Motion motion, const SpringOfDevice& spring, bool is_counted) {
  SimulatedDevice device(bare(model, is_counted));
  const spatial::Pose X_start = device.true_pose();
  device.hold_at(X_start);
  const bool is_along = motion == Motion::kAlong;
  const double inertia = is_along ? model.mass_kg : model.inertia_kg_m2;
  const double swing_s = 2 * std::numbers::pi * std::sqrt(inertia / spring.stiffness);
  const int judged = static_cast<int>(1e3 * std::max(kLeastJudged_s, swing_s)),
            ticks = static_cast<int>(kJudgings * judged);
  double first = 0, last = 0;
  for (int i = 0; i < ticks; ++i) {
    const DeviceState state = device.read(i * kTick_ns);
    const glm::dvec3 turned = spatial::vector_from_rotation(state.X_BD.R * glm::conjugate(X_start.R));
    const double x = is_along ? state.X_BD.p.x - X_start.p.x : turned.x;
    const double v = is_along ? state.V_BD_B.linear_m_s.x : state.V_BD_B.angular_rad_s.x;
    const double kick = i < kKickTicks ? (is_along ? kKick_N : kKick_Nm) : 0;
    const double F = kick - spring.stiffness * x - spring.damping * v;
    device.write(is_along ? spatial::Wrench{{0, 0, 0}, {F, 0, 0}} : spatial::Wrench{{F, 0, 0}, {0, 0, 0}});
    if (!(std::abs(x) < kGone)) return false;
    if (i < judged) first = std::max(first, std::abs(x));
    if (i >= ticks - judged) last = std::max(last, std::abs(x));
  }
  const double count = is_along ? model.position_step_m : model.rotation_step_rad;
  return last < std::max(kDecays * first, is_counted ? kCounts * count : 0.0);
}

}  // namespace

bool is_calm(const DeviceModel& model, Motion motion, const SpringOfDevice& spring) {
  return decays(model, motion, spring, false);
}

bool is_calm_as_counted(const DeviceModel& model, Motion motion, const SpringOfDevice& spring) {
  return decays(model, motion, spring, true);
}

double stiffest_calm(const DeviceModel& model, Motion motion, double damping) {
  double good = 0, bad = 1;
  while (is_calm(model, motion, {bad, damping})) good = bad, bad *= 2;
  if (good == 0) {
    while (bad > 1e-6 && !is_calm(model, motion, {0.5 * bad, damping})) bad *= 0.5;
    good = 0.5 * bad;
  }
  while (bad > 1.01 * good) {
    const double middle = std::sqrt(good * bad);
    (is_calm(model, motion, {middle, damping}) ? good : bad) = middle;
  }
  return good;
}

std::vector<DeviceRow> device_rows(const DeviceModel& model, devices::Grasp hand) {
  const devices::Coupling coupling = devices::coupling_of(model, hand);
  const DeviceModel soft = devices::at_softer_end(model);
  std::vector<DeviceRow> rows;
  const auto add = [&](Motion motion, const SpringOfDevice& picked, bool is_stated) {
    const bool calm = is_calm(soft, motion, picked) && is_calm(model, motion, picked) &&
                      is_calm_as_counted(soft, motion, picked) && is_calm_as_counted(model, motion, picked);
    rows.push_back({model.name, motion, 1e3 * devices::delay_s(soft), picked,
                    stiffest_calm(soft, motion, picked.damping), calm, is_stated});
  };
  if (model.force_dof > 0)
    add(Motion::kAlong, {coupling.stiffness_N_per_m, coupling.damping_Ns_per_m}, model.coupling_stiffness_N_per_m > 0);
  if (model.torque_dof > 0)
    add(Motion::kAbout, {coupling.stiffness_Nm_per_rad, coupling.damping_Nms_per_rad},
        model.coupling_stiffness_Nm_per_rad > 0);
  return rows;
}

}  // namespace farfeel::bench
