// The contact port is integrated from the poses that the tool went through and the force on it. Both are constant
// within a tick, the velocity and the force, so the sum over ticks is the integral at any finer step.
#include "tests/bench/loop_closed.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "haptic_core/contact/penalty.h"
#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "tests/bench/remote_across_link.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using spatial::Vector6;

constexpr double kPress_N = 1;
constexpr double kAbove_m = 2e-3, kWait_s = 0.2, kDescend_s = 0.3, kStill_s = 1.5, kJudged_s = 0.5;
constexpr double kStillMean_N = 0.05;  // less is no contact
constexpr double kPortBound_J = 1e-6, kMaxRipple = 0.05;

/// What one tick made.
struct Moment {
  Vector6 F_contact_To_W = Vector6::Zero();
  glm::dvec3 hand_N{0};
  spatial::Pose X_WT;
  double allowed_J = 0;
  bool is_sound = true;
};
using Tick = std::function<Moment(std::int64_t time_ns)>;

SimulatedDeviceSettings device_settings() {
  SimulatedDeviceSettings settings;
  settings.explorer.hints.p_TWork_T = {0, 0, 0};
  return settings;
}

HapticLoopSettings loop_settings(const StrokedScene& scene, double tick_hz) {
  HapticLoopSettings settings;
  settings.timing.period_ns = std::llround(1e9 / tick_hz);
  settings.X_TG.R = glm::conjugate(scene.R_WT());  // the handle is upright while the tool faces the surface
  return settings;
}

/// Runs the hand's program. lead_s: how long the hand waits above the surface.
ClosedLoop run(const StrokedScene& scene, const HandProgram& program, double tick_hz, double lead_s,
               SimulatedDevice& device, const Tick& tick) {
  const StrokePath path(program.strokes, program.start_m);
  const double stiffness = device_settings().grip.stiffness_N_per_m;
  const auto intent = [&](double t_s) {  // t_s = 0: the strokes begin
    const double down = std::clamp(-t_s / kDescend_s, 0.0, 1.0);
    const double press_m = (1 - down) * (kPress_N / stiffness + 1.5e-3) - down * kAbove_m;
    const double along_m = path.at_m(t_s), way = along_m / 5e-3;
    spatial::Pose X = scene.X_WT(along_m, 1.5e-3 * std::sin(0.7 * way + 0.3), 0.1 * std::sin(0.4 * way), press_m);
    X.R = X.R * glm::conjugate(scene.R_WT());
    return X;
  };
  const double dt_s = 1 / tick_hz, material = contact::combined(kDamped, kDamped).stiffness_N_per_m;
  const auto first = -std::lround((lead_s + kDescend_s) * tick_hz);
  const auto strokes_end = std::lround(path.length_s() * tick_hz);
  const auto last = strokes_end + std::lround(kStill_s * tick_hz),
             judged_from = last - std::lround(kJudged_s * tick_hz);
  const double pole = std::exp(-2 * std::numbers::pi * 20 * dt_s);

  ClosedLoop result;
  std::vector<glm::dvec3> contact_N, hand_N;
  spatial::Pose X_before = intent(-1e3);
  glm::dvec3 hand_before{0}, high{0}, sum{0};
  double port_J = 0, squares = 0, fastest_m_s = 0;
  for (long i = first; i < last; ++i) {
    const double t_s = static_cast<double>(i) * dt_s;
    device.hold_at(intent(t_s));
    const Moment now = tick(std::llround(1e9 * (t_s + 10)));
    result.is_sound = result.is_sound && now.is_sound;
    if (i > first) {
      const Vector6 moved = spatial::to_vector6(
          spatial::Twist{spatial::vector_from_rotation(glm::normalize(now.X_WT.R * glm::conjugate(X_before.R))),
                         now.X_WT.p - X_before.p});
      port_J -= now.F_contact_To_W.dot(moved);
      fastest_m_s = std::max(fastest_m_s, moved.tail<3>().norm() / dt_s);
      result.contact_min_J = std::min(result.contact_min_J, port_J + now.allowed_J);
    }
    high = pole * (high + now.hand_N - hand_before);
    if (i >= 0 && i < strokes_end) {
      contact_N.push_back(spatial::wrench_from(now.F_contact_To_W).force_N);
      hand_N.push_back(now.hand_N);
      result.largest_step_N = std::max(result.largest_step_N, glm::length(now.hand_N - hand_before));
    }
    if (i >= judged_from) squares += glm::dot(high, high), sum += now.hand_N;
    hand_before = now.hand_N;
    X_before = now.X_WT;
  }
  const auto judged = static_cast<double>(last - judged_from);
  const double mean_N = glm::length(sum) / judged;
  result.ripple_share =
      mean_N > kStillMean_N ? std::sqrt(squares / judged) / mean_N : std::numeric_limits<double>::infinity();
  result.contact = third_octaves(contact_N, tick_hz);
  result.hand = third_octaves(hand_N, tick_hz);
  result.device_min_J = device.hand_port().least_J();
  result.actuators_min_J = device.actuator_port().least_J();
  result.contact_bound_J = std::max(kPortBound_J, 0.5 * material * std::pow(fastest_m_s * dt_s, 2));
  return result;
}

/// Penalty springs and dampers of a contact set, with what the implicit step needs of them.
tool::LinearResponse response(const contact::ContactSet& set, const spatial::Twist& V) {
  tool::LinearResponse sum;
  for (std::uint32_t i = 0; i < set.count; ++i) {
    const contact::Contact& c = set.contacts[i];
    if (c.depth_m <= 0) continue;
    sum.F_To_W += spatial::to_vector6(contact::penalty_wrench(c, V));
    sum.mean_by_way -= 0.5 * contact::penalty_stiffness(c, spatial::Matrix6::Zero());
    sum.by_twist -= c.material.damping_Ns_per_m * c.gradient * c.gradient.transpose();
  }
  return sum;
}

}  // namespace

ClosedLoop stroke_through_link(const StrokedScene& scene, const HandProgram& program, local_model::Rung rung,
                               local_model::ContactLaw contact, double tick_hz, const transport::LinkSpec& link) {
  RemoteAcrossLink remote(scene, kDamped, link, RemoteAcrossLink::options_of(rung));
  SimulatedDevice device(device_settings());
  HapticLoopSettings settings = loop_settings(scene, tick_hz);
  settings.local_model.rung = rung;
  settings.local_model.contact = contact;
  HapticLoop loop(device, remote, settings, remote.contacts());
  const double lead_s = kWait_s + 3e-9 * static_cast<double>(link.round_trip_ns);
  return run(scene, program, tick_hz, lead_s, device, [&](std::int64_t time_ns) {
    remote.at(time_ns);
    loop.tick({time_ns, 0, 0, 0});
    TickRecord record;
    loop.records().pop(record);
    return Moment{
        spatial::to_vector6(record.F_contact_To_W), record.F_hand_W.force_N, record.X_WT,
        loop.local_model().tank().allowed_J(),
        spatial::is_finite(record.F_hand_W) && spatial::is_valid(record.X_WT) && loop.fault() == Fault::kNone};
  });
}

ClosedLoop stroke_on_truth(const StrokedScene& scene, const HandProgram& program, double tick_hz) {
  contact_service::ContactService service = scene.service(kDamped);
  SimulatedDevice device(device_settings());
  const HapticLoopSettings settings = loop_settings(scene, tick_hz);
  const tool::VirtualCoupling coupling(
      coupling_for(device.capabilities(), settings.scales, settings.body, settings.timing.period_ns), settings.X_TG);
  WrenchLimiter limiter(device.capabilities());
  HandleEstimate estimate(device.capabilities());
  tool::RigidTool tool{settings.body, {}, {}};
  const double dt_s = 1 / tick_hz;
  std::uint32_t sequence = 0;
  return run(scene, program, tick_hz, kWait_s, device, [&](std::int64_t time_ns) {
    DeviceState handle = device.read(time_ns);
    handle.X_BD = estimate.next(handle.X_BD, dt_s);
    if (sequence == 0) tool.X_WT = coupling.rest_pose(handle.X_BD);
    // As contacts from tiles are felt: amid the step, as the step's mean.
    const spatial::Pose X_amid_WT = spatial::integrate(tool.X_WT, tool.V_WT_W, 0.5 * dt_s);
    const contact::ContactSet& set = service.answer({sequence++, time_ns, X_amid_WT, tool.V_WT_W});
    tool::LinearResponse touched = response(set, tool.V_WT_W);
    touched.F_To_W -= dt_s * (touched.mean_by_way * spatial::to_vector6(tool.V_WT_W));
    tool::LinearResponse forces = coupling.evaluate(handle.X_BD, handle.V_BD_B, tool.X_WT, tool.V_WT_W).on_tool;
    forces += touched;
    const tool::StepWork stepped = tool::step(tool, forces, dt_s);
    const spatial::Wrench F_hand = limiter.limited(
        coupling.evaluate(handle.X_BD, handle.V_BD_B, tool.X_WT, tool.V_WT_W).F_hand_W, handle.V_BD_B, dt_s);
    device.write(F_hand);
    return Moment{tool::applied_wrench(touched, stepped, dt_s), F_hand.force_N, tool.X_WT, 0, true};
  });
}

bool is_stable(const ClosedLoop& felt, const ClosedLoop& truth) {
  return felt.is_sound && felt.ripple_share < kMaxRipple &&
         power_from(felt.contact, 0) < 2 * power_from(truth.contact, 0) + 1e-3;
}

}  // namespace farfeel::bench
