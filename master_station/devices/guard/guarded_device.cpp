#include "master_station/devices/guard/guarded_device.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::devices {
namespace {

using master_station::DeviceFault;
using master_station::DeviceState;
using spatial::no_longer_than;

constexpr double kMaxStep_s = 5e-3;     // a longer gap is no tick to ramp over
constexpr double kJumpSlack_m = 0.005;  // encoders may be read late once
constexpr double kContact_N = 0.1;      // what counts towards a first feeling
constexpr double kGentleRate_N_per_s = 150;
/// Of the coupling's stiffness and damping, which wall and coupling together exceed by so much: the rule leaves more.
constexpr double kWallShare = 0.1;

double or_else(double asked, double otherwise) {
  return asked > 0 ? asked : otherwise;
}

/// Caps that nobody asks for never go beyond what the device can.
master_station::DeviceCapabilities capped(const GuardSettings& settings) {
  const DeviceModel& model = settings.model;
  master_station::DeviceCapabilities device = capabilities_of(model, settings.hand);
  const double continuous_N = or_else(model.continuous_force_N, model.max_force_N);
  const double continuous_Nm = or_else(model.continuous_torque_Nm, model.max_torque_Nm);
  const double asked_N = or_else(settings.max_force_N, std::min(GuardedDevice::kDefaultCap_N, continuous_N));
  device.max_force_N = model.force_dof > 0 ? std::min(asked_N, model.max_force_N) : 0;
  device.max_torque_Nm =
      model.torque_dof > 0 ? std::min(or_else(settings.max_torque_Nm, continuous_Nm), model.max_torque_Nm) : 0;
  return device;
}

WorkspaceWall walls_of(const GuardSettings& settings, const master_station::DeviceCapabilities& device) {
  const double share =
      kWallShare * std::min(1.0, device.late_ns(1e6) / device.late_ns(static_cast<double>(settings.period_ns)));
  return {settings.model.workspace_min_B_m, settings.model.workspace_max_B_m, share * device.stable_stiffness_N_per_m,
          kWallShare * device.stable_damping_Ns_per_m};
}

/// The first n axes alone.
glm::dvec3 along(int n, const glm::dvec3& v) noexcept {
  return {n > 0 ? v.x : 0, n > 1 ? v.y : 0, n > 2 ? v.z : 0};
}

}  // namespace

GuardedDevice::GuardedDevice(master_station::Device& device, const GuardSettings& settings)
    : device_(device),
      settings_(settings),
      capabilities_(capped(settings_)),
      wall_(walls_of(settings_, capabilities_)),
      deadman_(settings_.model.enabling),
      heat_(capabilities_.max_force_N, or_else(settings_.model.continuous_force_N, settings_.model.max_force_N),
            settings_.model.thermal_time_s),
      axes_(settings_.model, capabilities_.max_force_N),
      trust_(settings_.is_new_device ? kFirstShare : 1) {
  is_trusted_.store(!settings_.is_new_device, std::memory_order_relaxed);
}

GuardedDevice::~GuardedDevice() {
  device_.write({});
}

void GuardedDevice::latch(DeviceFault fault) noexcept {
  if (this->fault() == DeviceFault::kNone) fault_.store(fault, std::memory_order_relaxed);
  deadman_.disarm();
}

void GuardedDevice::reset() noexcept {
  fault_.store(DeviceFault::kNone, std::memory_order_relaxed);
  deadman_.disarm();
  // The loop has ramped down long ago, mostly; it must not come up again into what is left of the gain.
  if (glm::length(F_written_B_.force_N) < kContact_N) gain_ = 0;
  stops_ = true;
  has_read_ = false;
  if (axes_.verdict() == AxisProbe::Verdict::kWrong) axes_ = AxisProbe(settings_.model, capabilities_.max_force_N);
  device_.reset();
}

DeviceFault GuardedDevice::found_in(const DeviceState& state, std::int64_t time_ns) noexcept {
  const bool is_old = state.time_ns != 0 && time_ns - state.time_ns > kStaleSample_ns;
  if (!state.is_live || is_old || state.stage == Stage::kAbsent) return DeviceFault::kSilent;
  if (!spatial::is_valid(state.X_BD) || !spatial::is_finite(state.V_BD_B)) return DeviceFault::kNotFinite;
  const double most = settings_.model.max_speed_m_s;
  if (most <= 0) return DeviceFault::kNone;
  const double since_s = static_cast<double>(time_ns - last_ns_) * 1e-9;
  const bool has_jumped = has_read_ && state.mapping == state_.mapping && state.opening == state_.opening &&
                          glm::length(state.X_BD.p - state_.X_BD.p) > 2 * most * since_s + kJumpSlack_m;
  return has_jumped || glm::length(state.V_BD_B.linear_m_s) > most ? DeviceFault::kTooFast : DeviceFault::kNone;
}

void GuardedDevice::advance_gain(bool is_on) noexcept {
  gain_ = std::clamp(gain_ + (is_on ? dt_s_ / kRise_s : -dt_s_ / stop_s_), 0.0, 1.0);
}

DeviceState GuardedDevice::read(std::int64_t time_ns) noexcept {
  DeviceState state = device_.read(time_ns);
  const DeviceFault found = found_in(state, time_ns);
  const bool is_good = found == DeviceFault::kNone;
  // In a longer gap the keeper took force off, and nobody saw what the handle did meanwhile: it tells nothing of axes.
  const bool was_away = last_ns_ != 0 && time_ns - last_ns_ > kStaleSample_ns;
  dt_s_ = last_ns_ != 0 ? std::clamp(static_cast<double>(time_ns - last_ns_) * 1e-9, 0.0, kMaxStep_s)
                        : static_cast<double>(settings_.period_ns) * 1e-9;
  last_ns_ = time_ns;
  // What is silent needs no reset: it is armed as soon as it is there again.
  if (!is_good && found != DeviceFault::kSilent) latch(found);

  const bool is_mapped_anew = has_read_ && is_good &&
                              (state.mapping != state_.mapping || state.is_clutch_held != state_.is_clutch_held ||
                               state.opening != state_.opening);
  gentle_s_ = is_mapped_anew ? kGentle_s : std::max(0.0, gentle_s_ - dt_s_);
  const bool is_another = is_good && state.opening != state_.opening;
  if (is_another) deadman_.disarm();
  const bool is_settling =
      is_mapped_anew || was_away || told_.is_settling || gentle_s_ > 0 || gain_ < 1 || is_trying_axes();
  settled_s_ = is_settling ? 0 : settled_s_ + dt_s_;
  watch_work(state, is_good && has_read_ && settled_s_ >= kSettled_s);
  told_ = {};

  const bool is_stopped = is_stopped_.load(std::memory_order_relaxed);
  const bool is_allowed = is_good && fault() == DeviceFault::kNone && state.stage == Stage::kReady && !is_stopped;
  const bool is_down = settings_.model.enabling == Enabling::kStation
                           ? time_ns < key_held_until_ns_.load(std::memory_order_relaxed)
                           : settings_.model.enable_button >= 0 &&
                                 ((state.buttons >> static_cast<unsigned>(settings_.model.enable_button)) & 1U) != 0;
  is_held_.store(is_down, std::memory_order_relaxed);
  const bool was_on = deadman_.is_on();
  const bool is_on = deadman_.next(is_allowed, is_down) && capabilities_.force_dof > 0;
  stops_ = stops_ && gain_ > 0;
  stop_s_ = is_allowed && !stops_ ? kRelease_s : kStop_s;
  if (is_on && !was_on) gave_work_ = false;
  try_axes(state, is_on && !was_away);
  const bool is_felt = is_on && !is_trying_axes();
  advance_gain(is_felt);
  if (found == DeviceFault::kSilent || is_another) {  // nobody feels a ramp then, or should come into one
    gain_ = 0;
    F_axes_B_N_ = F_axes_wanted_B_N_ = {};
  }

  if (is_good) state_ = state;
  has_read_ = is_good;
  const DeviceFault latched = fault() != DeviceFault::kNone ? fault() : found;
  if (latched != DeviceFault::kNone && latched != DeviceFault::kSilent) {
    state.stage = Stage::kFault;
  } else if (state.stage == Stage::kReady) {
    const bool has_force = gain_ > 0 || F_axes_B_N_ != glm::dvec3(0);
    state.stage = found == DeviceFault::kSilent ? Stage::kAbsent
                  : is_felt                     ? Stage::kEnabled
                  : is_on                       ? Stage::kTrying
                  : has_force                   ? Stage::kStopping
                                                : Stage::kReady;
  }
  state.fault = latched == DeviceFault::kNone && gave_work_ ? DeviceFault::kGivesWork : latched;
  state.is_live = state.is_live && found != DeviceFault::kSilent;
  stage_.store(state.stage, std::memory_order_relaxed);
  return state;
}

/// What a device that was felt before gives once too often ends the grip, not the session: a person takes hold again.
void GuardedDevice::watch_work(const DeviceState& state, bool is_watched) noexcept {
  if (!is_watched) {
    work_.restart();
    return;
  }
  // What holds the handle up does work all day, and walls give back what they took, however soft they are.
  const glm::dvec3 F_felt = F_written_B_.force_N - F_gravity_B_N_ - F_walls_B_N_;
  if (!work_.next({F_written_B_.torque_Nm, F_felt}, state_.X_BD, state.X_BD, told_.given_J, dt_s_, told_.moving_J))
    return;
  if (is_trusted()) {
    gave_work_ = true;
    deadman_.disarm();
  } else {
    latch(DeviceFault::kGivesWork);
  }
}

void GuardedDevice::try_axes(const DeviceState& state, bool is_held) noexcept {
  F_axes_wanted_B_N_ = {};
  if (!is_trying_axes()) return;
  if (!is_held) {
    axes_.interrupt();
    return;
  }
  F_axes_wanted_B_N_ = axes_.next(state.X_BD.p, state.V_BD_B.linear_m_s, dt_s_);
  if (axes_.verdict() == AxisProbe::Verdict::kWrong) latch(DeviceFault::kGoesElsewhere);
}

/// Of what is asked, along the axes that it has.
spatial::Wrench GuardedDevice::possible(const spatial::Wrench& F) const noexcept {
  return {along(capabilities_.torque_dof, F.torque_Nm), along(capabilities_.force_dof, F.force_N)};
}

double GuardedDevice::first_share(double force_N) noexcept {
  if (trust_ < 1 && gain_ > 0 && force_N > kContact_N) {
    trust_ = std::min(1.0, trust_ + (1 - kFirstShare) / kFirst_s * dt_s_);
    if (trust_ == 1) is_trusted_.store(true, std::memory_order_relaxed);
  }
  return trust_;
}

spatial::Wrench GuardedDevice::render(const spatial::Wrench& F_hand_B,
                                      const master_station::Circumstances& circumstances) noexcept {
  told_ = circumstances;
  // What objects took back came from what the limits withheld as well as from the hand: it is not asked back of the
  // hand.
  told_.given_J = told_.given_J > 0 && std::isfinite(told_.given_J) ? told_.given_J : 0;
  told_.moving_J = told_.moving_J > 0 && std::isfinite(told_.moving_J) ? told_.moving_J : 0;
  if (spatial::is_finite(F_hand_B)) {
    F_wanted_B_ = F_hand_B;
  } else {
    latch(DeviceFault::kNotFinite);
  }
  spatial::Wrench F = F_wanted_B_;
  F_walls_B_N_ = along(capabilities_.force_dof, wall_.force_N(state_.X_BD.p, state_.V_BD_B.linear_m_s));
  F_gravity_B_N_ = along(capabilities_.force_dof, settings_.gravity_B_N);
  F = possible(F);
  F.force_N += F_walls_B_N_ + F_gravity_B_N_;
  F = {no_longer_than(capabilities_.max_torque_Nm, F.torque_Nm), no_longer_than(heat_.limit_N(), F.force_N)};

  double step_N = capabilities_.max_force_rate_N_per_s * dt_s_;
  if (gentle_s_ > 0) step_N = std::min({step_N, kGentleRate_N_per_s * dt_s_, kGentle_N});
  const double step_Nm =  // full torque takes as long as full force
      capabilities_.max_force_N > 0 ? step_N * capabilities_.max_torque_Nm / capabilities_.max_force_N : 0;
  F_slewed_B_ = {F_slewed_B_.torque_Nm + no_longer_than(step_Nm, F.torque_Nm - F_slewed_B_.torque_Nm),
                 F_slewed_B_.force_N + no_longer_than(step_N, F.force_N - F_slewed_B_.force_N)};

  const double share = gain_ * first_share(glm::length(F_wanted_B_.force_N));
  F_axes_B_N_ += no_longer_than(step_N, F_axes_wanted_B_N_ - F_axes_B_N_);
  F = {no_longer_than(capabilities_.max_torque_Nm, share * F_slewed_B_.torque_Nm),
       no_longer_than(capabilities_.max_force_N, share * F_slewed_B_.force_N + F_axes_B_N_)};
  F_walls_B_N_ *= share, F_gravity_B_N_ *= share;
  heat_.advance(glm::length(F.force_N), dt_s_);
  F_written_B_ = F;
  device_.write(F);
  return F;
}

}  // namespace farfeel::devices
