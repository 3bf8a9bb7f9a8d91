#include "master_station/devices/hand/hand.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "haptic_core/spatial/no_longer_than.h"
#include "haptic_core/tool/virtual_coupling.h"

namespace farfeel::devices {
namespace {

using spatial::no_longer_than;

/// A longer gap is time that a rate did not live through, as the loop's own.
constexpr double kMostStep_s = 0.005;
constexpr double kCentred_m = 1e-6;  // finer than any device tells
/// What a device without force or torque is said to take at most, at which rate: to yield to, and to be told of.
constexpr double kTold_N = 10, kTold_Nm = 1, kTold_N_per_s = 2000, kTold_W = 10;

/// A of the twist, and its transpose: x -> z, y -> y, z -> -x.
glm::dvec3 ball(const glm::dvec3& v) {
  return {-v.z, v.y, v.x};
}
glm::dvec3 ball_back(const glm::dvec3& v) {
  return {v.z, v.y, -v.x};
}

/// v without the part against `back`, as far as `back` has come to `most`.
glm::dvec3 yielding(const glm::dvec3& v, const glm::dvec3& back, double most) {
  const double length = glm::length(back);
  if (!(length > 0)) return v;
  const glm::dvec3 n = back / length;
  return v - std::min(glm::dot(v, n), 0.0) * std::min(length / most, 1.0) * n;
}

RateSettings rate_settings(const DeviceModel& model, Axes axes, double speed_m_s, double workspace_scale) {
  const double faster = speed_m_s > 0 && model.full_speed_m_s > 0 ? speed_m_s / model.full_speed_m_s : 1;
  const double full_m_s = speed_m_s > 0 ? speed_m_s : model.full_speed_m_s;
  return {axes, full_m_s / workspace_scale, faster * model.full_rotation_rad_s};
}

master_station::DeviceCapabilities capabilities_with(const DeviceModel& model, master_station::DeviceCapabilities c,
                                                     const HandSettings& settings, double full_rate_m_s) {
  constexpr tool::CouplingGains kUnfelt;  // nobody feels the coupling of a device without force
  c.pose_dof = 6;
  const bool has_torque = model.torque_dof > 0, has_force = model.force_dof > 0;
  if (!has_force) {
    c.max_force_N = kTold_N;
    c.max_force_rate_N_per_s = kTold_N_per_s;
    c.max_power_W = kTold_W;
  }
  if (!has_torque) c.max_torque_Nm = kTold_Nm;
  c.force_dof = c.torque_dof = 3;
  if (!has_force && !(c.stable_stiffness_N_per_m > 0)) {
    c.stable_stiffness_N_per_m = kUnfelt.stiffness_N_per_m;
    c.stable_damping_Ns_per_m = kUnfelt.damping_Ns_per_m;
  }
  if (!has_torque && !(c.stable_rotational_stiffness_Nm_per_rad > 0)) {
    c.stable_rotational_stiffness_Nm_per_rad = kUnfelt.rotational_stiffness_Nm_per_rad;
    c.stable_rotational_damping_Nms_per_rad = kUnfelt.rotational_damping_Nms_per_rad;
  }
  if (has_force && settings.orientation == OrientationFrom::kTwist) {
    // A spring K_r about the tool is a spring k^2 K_r at the handle that twists it.
    constexpr double k = Hand::kTwist_rad_per_m;
    const auto soften = [](double& own, double lever) { own = std::min(own, lever); };
    soften(c.stable_rotational_stiffness_Nm_per_rad, c.stable_stiffness_N_per_m / (k * k));
    soften(c.stable_rotational_damping_Nms_per_rad, c.stable_damping_Ns_per_m / (k * k));
    c.rotation_step_rad = std::max(c.rotation_step_rad, k * c.position_step_m);
  }
  c.max_speed_m_s = model.tells == Tells::kRate ? std::max(c.max_speed_m_s, 2 * full_rate_m_s)
                                                : (1 + Hand::kCentring) * c.max_speed_m_s;
  return c;
}

double towards(double value, double wanted, double most) {
  return value + std::clamp(wanted - value, -most, most);
}

spatial::Twist turned(const glm::dquat& R, const spatial::Twist& V) {
  return {R * V.angular_rad_s, R * V.linear_m_s};
}

}  // namespace

OrientationFrom default_orientation(const DeviceModel& primary, bool has_second) noexcept {
  if (has_second) return OrientationFrom::kSecond;
  return primary.tells == Tells::kRate || primary.rotation_dof == 3 ? OrientationFrom::kOwn : OrientationFrom::kFixed;
}

int default_twist_button(const DeviceModel& primary) noexcept {
  int button = 0;
  while (button == primary.enable_button || button == primary.clutch_button) ++button;
  return button;
}

Hand::Hand(SourceDevice& primary, master_station::Device& guarded, SampleSource* second, SampleSource* view,
           const HandSettings& settings) noexcept
    : primary_(primary),
      guarded_(guarded),
      second_(second),
      view_(view),
      settings_(settings),
      primary_rate_(rate_settings(primary.model(), settings.axes, settings.rate_speed_m_s, settings.workspace_scale)),
      second_rate_(second ? rate_settings(second->model(), Axes::kRotation, 0, 1) : RateSettings{}),
      view_rate_(view ? rate_settings(view->model(), Axes::kRotation, 0, 1) : RateSettings{}),
      X_BD_(settings.X_BD_start),
      orientation_(settings.orientation) {
  const RateSettings rate =
      rate_settings(primary.model(), settings.axes, settings.rate_speed_m_s, settings.workspace_scale);
  capabilities_ = capabilities_with(primary.model(), guarded.capabilities(), settings, rate.full_speed_m_s);
  own_turns_ = settings.orientation == OrientationFrom::kOwn ? 1 : 0;
  second_turns_ = settings.orientation == OrientationFrom::kSecond && second ? 1 : 0;
}

void Hand::change_factors(const Sample& primary, bool is_clutch_held, double dt_s) noexcept {
  const OrientationFrom from = orientation_.load(std::memory_order_relaxed);
  const bool can_twist = settings_.orientation == OrientationFrom::kTwist && !is_rate() && settings_.twist_button >= 0;
  const bool is_twisting =
      from == OrientationFrom::kTwist && can_twist && primary.has_button(static_cast<unsigned>(settings_.twist_button));
  const double most = dt_s / kChange_s;
  moving_ = towards(moving_, is_twisting ? 0 : 1, most);
  twisting_ = towards(twisting_, is_twisting ? 1 : 0, most);
  own_turns_ = towards(own_turns_, from == OrientationFrom::kOwn ? 1 : 0, most);
  second_turns_ = towards(second_turns_, from == OrientationFrom::kSecond && second_ ? 1 : 0, most);
  if (is_twisting != was_twisting_) primary_.map_anew();
  was_twisting_ = is_twisting;
  if (is_twisting || is_clutch_held) is_centred_.store(true, std::memory_order_relaxed);
}

Motion Hand::rate_motion_B(RateControl& control, const Sample& sample, const DeviceModel& model, const glm::dquat& R,
                           bool is_on, double dt_s) const noexcept {
  const bool is_set_up = is_on && is_heard(sample, model.reports, time_ns_);
  const double trusted = is_set_up ? trusted_share(silence_ns(sample, model.reports, time_ns_)) : 0;
  const bool is_held = model.clutch_button >= 0 && sample.has_button(static_cast<unsigned>(model.clutch_button));
  spatial::Twist V = turned(R, control.advance(is_held ? Deflection{} : sample.deflection, trusted, dt_s));
  V.linear_m_s = yielding(V.linear_m_s, F_hand_B_.force_N, kYield_N);
  V.angular_rad_s = yielding(V.angular_rad_s, F_hand_B_.torque_Nm, kYield_Nm);
  return {dt_s * V.angular_rad_s, dt_s * V.linear_m_s, V};
}

void Hand::turn_view(std::int64_t time_ns, bool is_on, double dt_s) noexcept {
  if (!view_) return;
  const Sample& sample = view_->newest(time_ns);
  const DeviceModel& model = view_->model();
  const bool is_set_up = is_on && is_heard(sample, model.reports, time_ns);
  const double trusted = is_set_up ? trusted_share(silence_ns(sample, model.reports, time_ns)) : 0;
  const double rate_rad_s = view_rate_.advance({{0, 0, sample.deflection.turn.z}, {}}, trusted, dt_s).angular_rad_s.z;
  view_->command({time_ns, {}, sample.opening, false, is_set_up});
  if (rate_rad_s == 0) return;
  const double yaw_rad = std::remainder(view_yaw_rad() + dt_s * rate_rad_s, 2 * std::acos(-1.0));
  view_yaw_rad_.store(yaw_rad, std::memory_order_relaxed);
  R_view_ = spatial::rotation_from_vector({0, 0, yaw_rad});
  is_centred_.store(true, std::memory_order_relaxed);
}

Motion Hand::primary_motion_B(const Sample& sample, bool is_on, bool is_clutch_held, double dt_s) noexcept {
  const glm::dquat R = R_view_ * settings_.R_BP;
  if (is_rate()) return rate_motion_B(primary_rate_, sample, primary_.model(), R, is_on && !is_clutch_held, dt_s);
  const Motion motion = primary_follower_.advance(sample, is_on);
  return {R * motion.turned_rad, R * motion.moved_m, turned(R, motion.V)};
}

Motion Hand::second_motion_B(std::int64_t time_ns, bool is_on, double dt_s) noexcept {
  if (!second_) return {};
  const Sample& sample = second_->newest(time_ns);
  const DeviceModel& model = second_->model();
  const bool can_be_used = is_heard(sample, model.reports, time_ns) && is_usable(sample);
  const bool is_wanted = orientation_.load(std::memory_order_relaxed) == OrientationFrom::kSecond;
  is_orientation_live_.store(can_be_used || !is_wanted, std::memory_order_relaxed);
  second_->command({time_ns, {}, sample.opening, false, can_be_used && is_wanted});
  const glm::dquat R = R_view_ * settings_.R_BSecond;
  if (model.tells == Tells::kRate) return rate_motion_B(second_rate_, sample, model, R, is_on && can_be_used, dt_s);
  const Motion motion = second_follower_.advance(sample, is_on && can_be_used);
  return {R * motion.turned_rad, {}, turned(R, motion.V)};
}

void Hand::begin(const Sample& sample) noexcept {
  has_begun_ = true;
  opening_ = sample.opening;
  const DeviceModel& model = primary_.model();
  const glm::dvec3 size = model.workspace_max_B_m - model.workspace_min_B_m;
  const bool has_middle = !is_rate() && std::min({size.x, size.y, size.z}) >= 0 && glm::length(size) > 0;
  off_centre_B_m_ = has_middle
                        ? settings_.R_BP * (sample.X_BD.p - 0.5 * (model.workspace_min_B_m + model.workspace_max_B_m))
                        : glm::dvec3(0);
  p_PTrail_P_m_ = sample.X_BD.p;
  is_centred_.store(glm::length(off_centre_B_m_) < kCentred_m, std::memory_order_relaxed);
}

/// Adds a share of the handle's own motion, towards where the middle of the workspace is the start. Never against the
/// force on the hand, so that it puts no work into the coupling.
void Hand::centre(const Sample& sample, Motion& handle_B) noexcept {
  const glm::dvec3 drawn = sample.X_BD.p - p_PTrail_P_m_;
  const double dragged_m = glm::length(drawn) - kCentringSlack_m;
  if (!(dragged_m > 0)) return;
  p_PTrail_P_m_ += dragged_m / glm::length(drawn) * drawn;
  const glm::dvec3& F = F_hand_B_.force_N;
  const double off_m = glm::length(off_centre_B_m_), moved_m = glm::length(handle_B.moved_m);
  if (glm::length(F) > kFree_N || glm::dot(F, off_centre_B_m_) < 0 || !(moved_m > 0)) return;
  const double step_m = std::min({off_m, kCentring * dragged_m, kCentring * moved_m});
  const glm::dvec3 direction = off_centre_B_m_ / off_m;
  off_centre_B_m_ -= step_m * direction;
  if (off_m - step_m < kCentred_m) is_centred_.store(true, std::memory_order_relaxed);
  handle_B.V.linear_m_s += step_m / moved_m * glm::length(handle_B.V.linear_m_s) * direction;
  handle_B.moved_m += step_m * direction;
}

glm::dvec3 Hand::twist_of(const glm::dvec3& moved_B) const noexcept {
  return kTwist_rad_per_m * (R_view_ * ball(glm::conjugate(R_view_) * moved_B));
}

glm::dvec3 Hand::force_of_twist(const glm::dvec3& torque_B) const noexcept {
  return kTwist_rad_per_m * (R_view_ * ball_back(glm::conjugate(R_view_) * torque_B));
}

void Hand::move(const Motion& handle_B, const Motion& second_B, double dt_s) noexcept {
  const auto turning = [&](const glm::dvec3& own, const glm::dvec3& second, const glm::dvec3& moved) {
    return own_turns_ * own + second_turns_ * second + twisting_ * twist_of(moved);
  };
  const glm::dvec3 turn = turning(handle_B.turned_rad, second_B.turned_rad, handle_B.moved_m);
  V_BD_B_ = {turning(handle_B.V.angular_rad_s, second_B.V.angular_rad_s, handle_B.V.linear_m_s),
             moving_ * handle_B.V.linear_m_s};
  X_BD_.R = glm::normalize(spatial::rotation_from_vector(turn) * X_BD_.R);
  const glm::dvec3 before = X_BD_.p;
  X_BD_.p += moving_ * handle_B.moved_m;
  if (!is_rate()) return;
  const glm::dvec3 reach(settings_.reach_m / settings_.workspace_scale), start = settings_.X_BD_start.p;
  X_BD_.p = glm::clamp(X_BD_.p, start - reach, start + reach);
  if (dt_s > 0) V_BD_B_.linear_m_s = (X_BD_.p - before) / dt_s;
}

void Hand::recentre() noexcept {
  X_BD_ = settings_.X_BD_start;
  is_centred_.store(true, std::memory_order_relaxed);
}

master_station::DeviceState Hand::read(std::int64_t time_ns) noexcept {
  const double gap_s = has_begun_ ? 1e-9 * static_cast<double>(time_ns - time_ns_) : 0;
  const double dt_s = std::clamp(gap_s, 0.0, kMostStep_s);
  time_ns_ = time_ns;
  master_station::DeviceState state = guarded_.read(time_ns);
  const Sample& sample = primary_.sample();
  const bool is_finite = is_usable(sample), is_on = state.is_live && is_finite;
  if (is_on && !has_begun_) begin(sample);
  if (is_on && sample.opening != opening_) {
    opening_ = sample.opening;
    is_centred_.store(true, std::memory_order_relaxed);
  }
  if (is_on) change_factors(sample, state.is_clutch_held, dt_s);
  turn_view(time_ns, is_on, dt_s);
  Motion handle_B = primary_motion_B(sample, is_on, state.is_clutch_held, dt_s);
  if (is_on && !is_centred()) centre(sample, handle_B);
  move(handle_B, second_motion_B(time_ns, is_on, dt_s), dt_s);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  state.X_BD = is_finite ? X_BD_ : spatial::Pose{{kNan, kNan, kNan, kNan}, glm::dvec3(kNan)};
  state.V_BD_B = V_BD_B_;
  return state;
}

spatial::Wrench Hand::render(const spatial::Wrench& F_hand_B,
                             const master_station::Circumstances& circumstances) noexcept {
  const DeviceModel& model = primary_.model();
  const bool is_finite = spatial::is_finite(F_hand_B);
  F_hand_B_ = is_finite ? F_hand_B : spatial::Wrench{};
  const auto& [torque, force] = F_hand_B_;
  const glm::dquat R_PB = glm::conjugate(R_view_ * settings_.R_BP);
  const double has_force = model.force_dof > 0 ? 1 : 0, has_torque = model.torque_dof > 0 ? 1 : 0;
  const glm::dvec3 of_twist = force_of_twist(no_longer_than(capabilities_.max_force_N / kTwist_rad_per_m, torque));
  const spatial::Wrench F_P{has_torque * own_turns_ * (R_PB * torque),
                            has_force * (R_PB * (moving_ * force + twisting_ * of_twist))};
  const double felt_torque = std::max(has_torque * own_turns_, has_force * twisting_);
  masked_torque_Nm_.store((1 - felt_torque) * glm::length(torque), std::memory_order_relaxed);
  masked_force_N_.store((1 - has_force * moving_) * glm::length(force), std::memory_order_relaxed);
  const spatial::Wrench felt_P = guarded_.render(is_finite ? F_P : F_hand_B, circumstances);
  return {glm::conjugate(R_PB) * felt_P.torque_Nm, glm::conjugate(R_PB) * felt_P.force_N};
}

}  // namespace farfeel::devices
