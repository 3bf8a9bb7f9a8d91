#include "tests/bench/teleoperation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "haptic_core/contact/penalty.h"
#include "haptic_core/teleoperation/handle_end.h"
#include "haptic_core/teleoperation/remote_end.h"
#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/haptic_loop.h"
#include "tests/bench/loop_watch.h"
#include "tests/support/analytic_remote.h"

namespace farfeel::bench {
namespace {

using namespace master_station;
using spatial::Vector6;
using test_support::AnalyticWorld;

constexpr double kWait_s = 0.5, kPress_s = 1.75, kJudged_s = 0.5;  // judged: the last part, from 1.25 s on
constexpr double kPress_N = 3;

AnalyticWorld wall(double stiffness_N_per_m) {
  AnalyticWorld world;
  world.near_m = 0.05;
  world.points_T = {{0.03, 0.03, 0}, {0.03, -0.03, 0}, {-0.03, 0.03, 0}, {-0.03, -0.03, 0}};
  world.material.stiffness_N_per_m = stiffness_N_per_m / 4;
  world.material.damping_Ns_per_m = 0.1;
  return world;
}

tool::MassProperties plate(double mass_kg) {
  return tool::with_mass({0.02, Eigen::Vector3d(6e-6, 6e-6, 1.2e-5).asDiagonal()}, mass_kg);
}

/// The penalty law at the remote, with what the implicit step needs of it.
tool::LinearResponse contact_response(const AnalyticWorld& world, const spatial::Pose& X_WT, const spatial::Twist& V) {
  tool::LinearResponse sum;
  const contact::ContactSet set = world.contacts(X_WT);
  for (std::size_t i = 0; i < set.count; ++i) {
    sum.F_To_W += spatial::to_vector6(contact::penalty_wrench(set.contacts[i], V));
    sum.by_pose -= contact::penalty_stiffness(set.contacts[i], spatial::Matrix6::Zero());
  }
  return sum;
}

template <typename T>
class DelayLine {
 public:
  DelayLine(std::size_t ticks, const T& initial) : values_(ticks + 1, initial) {}
  /// Puts one in, takes out the one that went in `ticks` ago.
  T pass(const T& value) {
    values_[next_] = value;
    next_ = (next_ + 1) % values_.size();
    return values_[next_];
  }

 private:
  std::vector<T> values_;
  std::size_t next_ = 0;
};

/// What renders: called once a tick.
class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual void tick(std::int64_t time_ns) = 0;
  virtual void tell_port(Press&) const {}
};

class ThroughTheLoop final : public Renderer {
 public:
  ThroughTheLoop(SimulatedDevice& device, const Setting& setting)
      : device_(device),
        wall_N_per_m_(setting.wall_N_per_m),
        loop_(device, remote_, settings(setting)),
        watch_(settings(setting).timing.period_ns) {
    remote_.world = wall(setting.wall_N_per_m);
    remote_.set_link({.round_trip_ns = std::llround(setting.round_trip_s * 1e9)});
    remote_.on_answer = [this](contact::ContactSet& set) {  // for the held wrench
      set.F_To_W = spatial::wrench_from(contact_response(remote_.world, set.X_WT, remote_.sent.V_WT_W).F_To_W);
    };
  }
  void tick(std::int64_t time_ns) override {
    loop_.tick({time_ns, 0, 0, 0});
    watch_.look(loop_, wall_N_per_m_, false, false);
  }
  void tell_port(Press& press) const override {
    const LoopFigures figures = watch_.figures(loop_, device_);
    press.contact_min_J = figures.contact_excess_J;
    press.contact_bound_J = figures.contact_bound_J;
  }

 private:
  static HapticLoopSettings settings(const Setting& setting) {
    HapticLoopSettings settings;
    settings.timing.period_ns = std::llround(1e9 / setting.tick_hz);
    settings.body = plate(setting.tool_mass_kg);
    settings.local_model.rung =
        setting.method == Method::kHeldWrench ? local_model::Rung::kHeldWrench : local_model::Rung::kLinear;
    settings.local_model.contact = setting.contact;
    if (setting.method == Method::kOursMidpoint) settings.integrator = tool::Integrator::kMidpoint;
    return settings;
  }
  const SimulatedDevice& device_;
  double wall_N_per_m_;
  test_support::AnalyticRemote remote_;
  HapticLoop loop_;
  LoopWatch watch_;
};

teleoperation::Controller controller_of(Method method) {
  return method == Method::kWave         ? teleoperation::Controller::kWaves
         : method == Method::kTimeDomain ? teleoperation::Controller::kPassivity
                                         : teleoperation::Controller::kDirect;
}

class AcrossTheLine final : public Renderer {
 public:
  AcrossTheLine(Device& device, const Setting& setting)
      : device_(device),
        setting_(setting),
        world_(wall(setting.wall_N_per_m)),
        dt_s_(1 / setting.tick_hz),
        limiter_(device.capabilities()),
        there_(static_cast<std::size_t>(std::lround(0.5 * setting.round_trip_s * setting.tick_hz)), {}),
        back_(static_cast<std::size_t>(std::lround(0.5 * setting.round_trip_s * setting.tick_hz)), {}),
        here_(controller_of(setting.method)) {}

  void tick(std::int64_t time_ns) override {
    const DeviceState handle = device_.read(time_ns);
    if (!has_started_) far_ = {controller_of(setting_.method), plate(setting_.tool_mass_kg), handle.X_BD};
    has_started_ = true;
    const auto step = here_.tick(spatial::to_vector6(handle.V_BD_B), arrived_, dt_s_);
    device_.write(limiter_.limited(spatial::wrench_from(step.F_hand), handle.V_BD_B, dt_s_));
    arrived_ = back_.pass(answer(there_.pass({handle.X_BD, step.out, true})));
  }

 private:
  struct Packet {
    spatial::Pose X;
    teleoperation::LineValue line;
    bool is_real = false;
  };

  teleoperation::LineValue answer(const Packet& in) {
    if (setting_.method == Method::kDirect) {
      if (!in.is_real) return {};
      return {contact_response(world_, in.X, spatial::twist_from(in.line.value)).F_To_W, 0};
    }
    const tool::RigidTool& tool = far_.tool();
    return far_.answer(in.line, contact_response(world_, tool.X_WT, tool.V_WT_W), dt_s_);
  }

  Device& device_;
  Setting setting_;
  AnalyticWorld world_;
  double dt_s_;
  WrenchLimiter limiter_;
  DelayLine<Packet> there_;
  DelayLine<teleoperation::LineValue> back_;
  teleoperation::LineValue arrived_;
  teleoperation::HandleEnd here_;
  teleoperation::RemoteEnd far_;
  bool has_started_ = false;
};

}  // namespace

std::string_view name(Method method) {
  switch (method) {
    case Method::kOurs:
      return "ours";
    case Method::kOursMidpoint:
      return "ours, midpoint rule";
    case Method::kHeldWrench:
      return "held wrench";
    case Method::kDirect:
      return "direct";
    case Method::kWave:
      return "wave variables";
    case Method::kTimeDomain:
      return "time-domain passivity";
  }
  return "unknown";
}

Press press(const Setting& setting) {
  SimulatedDeviceSettings device_settings;
  device_settings.grip = setting.grip;
  device_settings.explorer.hints.p_TWork_T = {0, 0, 0};
  SimulatedDevice device(device_settings);
  const spatial::Pose X_above = device.true_pose();
  device.hold_at(X_above);
  std::unique_ptr<Renderer> renderer;
  if (has_model(setting.method)) {
    renderer = std::make_unique<ThroughTheLoop>(device, setting);
  } else {
    renderer = std::make_unique<AcrossTheLine>(device, setting);
  }

  const double dt_s = 1 / setting.tick_hz;
  const auto ticks = std::lround((kWait_s + kPress_s) * setting.tick_hz);
  const auto pressing_from = std::lround(kWait_s * setting.tick_hz);
  const auto judged_from = ticks - std::lround(kJudged_s * setting.tick_hz);
  const double pole = std::exp(-2 * std::numbers::pi * 20 * dt_s);
  double high = 0, previous = 0, sum_N = 0, sum_m = 0, squares = 0;
  for (long i = 0; i < ticks; ++i) {
    if (i == pressing_from) {
      spatial::Pose X = X_above;
      X.p.z = -kPress_N / setting.grip.stiffness_N_per_m;
      device.hold_at(X);
    }
    renderer->tick(std::llround(static_cast<double>(i) * dt_s * 1e9));
    const double force_N = device.force_on_hand().force_N.z;
    high = pole * (high + force_N - previous);
    previous = force_N;
    if (i >= judged_from) sum_N += force_N, sum_m -= device.true_pose().p.z, squares += high * high;
  }
  const auto judged = static_cast<double>(ticks - judged_from);
  const double mean_N = sum_N / judged;
  Press result;
  result.ripple_share = mean_N > 0.05 ? std::sqrt(squares / judged) / mean_N : std::numeric_limits<double>::infinity();
  result.is_stable = result.ripple_share < 0.05;
  result.displayed_N_per_m = sum_m > 0 ? sum_N / sum_m : 0;
  result.device_min_J = device.hand_port().least_J();
  renderer->tell_port(result);
  return result;
}

}  // namespace farfeel::bench
