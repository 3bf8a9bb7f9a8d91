#include "master_station/haptic_loop/haptic_loop.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"

namespace farfeel::master_station {
namespace {

/// Below this round trip a linearised contact is nearly where it was: better than ticks on tiles that come too late.
constexpr double kFresh_ms = 5;
constexpr double kRoundTripShare = 0.02;  // of the newest, in the mean
constexpr double kMinMass_kg = 0.001, kMaxMass_kg = 0.1;
constexpr double kMaxStep_s = 0.005;  // a longer gap is time the tool did not live through
constexpr double kStall_s = 0.02;     // a handle that nobody read for longer counts as silent
constexpr double kFaultRamp_s = 0.1;
constexpr double kComesToRest_s = 0.05;  // a tool that nobody holds; let off a surface it goes some millimetres
constexpr double kUntouched_s = 0.02;    // without contact before "touching" becomes "free"
constexpr double kFreshAgain_s =
    0.06;                             // of fresh contacts before "held" or "fading" is over: one answer keeps them 0.05
constexpr int kMostCoursesATick = 4;  // each is copied three times; the others wait for the next tick
constexpr double kJumpSlack_m = 0.005;  // encoders may be read late once
constexpr double kPulls_N = 0.2;        // a hand that takes hold of a tool that pulls more takes hold where the tool is

tool::MassProperties simulated(const tool::MassProperties& body) {
  return tool::with_mass(body, std::clamp(body.mass_kg, kMinMass_kg, kMaxMass_kg));
}

local_model::LocalModelSettings for_tool(local_model::LocalModelSettings settings, const tool::MassProperties& body) {
  settings.tool_mass_kg = simulated(body).mass_kg;
  return settings;
}

/// Of its readings: where the handle is, nobody knows.
bool is_device_fault(Fault fault) {
  return fault == Fault::kDeviceNotFinite || fault == Fault::kDeviceTooFast || fault == Fault::kDeviceSilent;
}

Fault told_by(const DeviceState& device) {
  switch (device.fault) {
    case DeviceFault::kNone:
      return device.is_live ? Fault::kNone : Fault::kDeviceSilent;
    case DeviceFault::kSilent:
      return Fault::kDeviceSilent;
    case DeviceFault::kNotFinite:
      return Fault::kDeviceNotFinite;
    case DeviceFault::kTooFast:
      return Fault::kDeviceTooFast;
    case DeviceFault::kGivesWork:
      return Fault::kDeviceGivesWork;
    case DeviceFault::kGoesElsewhere:
      return Fault::kDeviceGoesElsewhere;
  }
  return Fault::kNone;
}

}  // namespace

/// What is true of a tick of 1 ms is scaled by (T/2 + t_delay), with T no shorter than the device's own exchange. A
/// shorter tick allows a stiffer spring in proportion, but B stays, and a heavy tool on a spring so
/// much stiffer rings where nothing else damps it. So it is no stiffer than B damps well enough, or at 1 kHz anyway.
/// An axis on which the hand feels nothing bounds nothing: there the tool is held as stiffly as the simulated standard
/// device holds it, and damped critically, so that it is calm.
tool::CouplingGains coupling_for(const DeviceCapabilities& device, const GearScales& scales,
                                 const tool::MassProperties& body, std::int64_t period_ns) noexcept {
  constexpr double kLeastDampingRatio = 0.05;
  constexpr double kUnfelt_N_per_m = 2000, kUnfelt_Nm_per_rad = 6;
  // Beyond 4 kHz other limits rule.
  const double faster = std::clamp(device.late_ns(1e6) / device.late_ns(static_cast<double>(period_ns)), 0.2, 4.0);
  const auto stiffness = [&](double at_1_kHz, double damping, double inertia) {
    const double damped = std::pow(0.5 * damping / kLeastDampingRatio, 2) / std::max(inertia, 1e-12);
    return std::min(faster * at_1_kHz, std::max(at_1_kHz, damped));
  };
  const double linear = scales.workspace * scales.force,
               turning = scales.torque();  // as the hand feels them: handle_gear.h
  const double b_t = device.stable_damping_Ns_per_m / linear,
               b_r = device.stable_rotational_damping_Nms_per_rad / turning;
  const double most_kgm2 = body.inertia_To_T.diagonal().maxCoeff();
  const auto critical = [](double k, double inertia) { return 2 * std::sqrt(k * inertia); };
  tool::CouplingGains gains{kUnfelt_N_per_m, critical(kUnfelt_N_per_m, body.mass_kg), kUnfelt_Nm_per_rad,
                            critical(kUnfelt_Nm_per_rad, most_kgm2)};
  if (device.force_dof > 0) {
    gains.stiffness_N_per_m = stiffness(device.stable_stiffness_N_per_m / linear, b_t, body.mass_kg);
    gains.damping_Ns_per_m = b_t;
  }
  if (device.torque_dof > 0) {
    gains.rotational_stiffness_Nm_per_rad =
        stiffness(device.stable_rotational_stiffness_Nm_per_rad / turning, b_r, most_kgm2);
    gains.rotational_damping_Nms_per_rad = b_r;
  }
  return gains;
}

HapticLoop::HapticLoop(Device& device, Remote& remote, const HapticLoopSettings& settings,
                       local_model::LocalContacts* contacts)
    : device_(device),
      remote_(remote),
      contacts_(settings.local_model.rung != local_model::Rung::kHeldWrench ? contacts : nullptr),
      settings_(settings),
      handle_(device.capabilities()),
      gear_(settings.scales),
      coupling_(
          coupling_for(device.capabilities(), settings.scales, simulated(settings.body), settings.timing.period_ns),
          settings.X_TG),
      moving_(settings.moving),
      local_model_(for_tool(settings.local_model, settings.body)),
      limiter_(device.capabilities()),
      line_end_(teleoperation::make_handle_end(settings.controller)),
      touching_(constraint::untouched({simulated(settings.body), {}, {}})),
      records_(settings.record_capacity) {
  if (line_end_) contacts_ = nullptr;
}

void HapticLoop::latch(Fault fault) noexcept {
  if (fault_.load(std::memory_order_relaxed) != Fault::kNone) return;
  fault_.store(fault, std::memory_order_relaxed);
  ++faults_;
  limiter_.ramp_down(kFaultRamp_s);
}

void HapticLoop::forget_fault() noexcept {
  fault_.store(Fault::kNone, std::memory_order_relaxed);
  if (!is_paused_) limiter_.restore();
  is_handle_known_ = false;
}

bool HapticLoop::obey() noexcept {
  const bool is_reset = is_reset_asked_.exchange(false, std::memory_order_relaxed) && fault() != Fault::kNone;
  if (is_reset) forget_fault();
  const bool wants_pause = is_paused();
  if (wants_pause && !is_paused_ && fault() == Fault::kNone) limiter_.ramp_down(kFaultRamp_s);
  // Whoever goes on at once waits until the force has faded: the device is armed without any.
  const bool is_resumed = is_paused_ && !wants_pause && limiter_.is_off();
  is_paused_ = wants_pause || (is_paused_ && !is_resumed);
  if (is_resumed && fault() == Fault::kNone) limiter_.restore();
  if (is_reset || (is_resumed && fault() == Fault::kNone)) device_.reset();
  if (is_resumed) is_recentre_asked_.store(false, std::memory_order_relaxed);
  // Once the hand has let go: the handle's pose may jump then, and nothing moves with it.
  if (is_paused_ && is_placed_ && gear_.engagement() == 0 &&
      is_recentre_asked_.exchange(false, std::memory_order_relaxed)) {
    is_recentring_ = true;
    device_.recentre();
    is_handle_known_ = false;
    handle_.forget();
  }
  is_recentring_ = is_recentring_ && is_paused_;
  return is_reset || is_resumed;
}

/// Takes over the handle's state, or latches a fault and leaves the handle where it was last believed, at rest.
void HapticLoop::read_device(std::int64_t time_ns, double dt_s) noexcept {
  const DeviceState read = device_.read(time_ns);
  const double max_speed = device_.capabilities().max_speed_m_s;
  const spatial::Pose X_WD = settings_.X_WB * read.X_BD;
  const bool is_too_fast = glm::length(read.V_BD_B.linear_m_s) > max_speed ||
                           (is_handle_known_ && glm::length(X_WD.p - X_WD_.p) > 2 * max_speed * dt_s + kJumpSlack_m);
  Fault found = told_by(read);
  if (found == Fault::kNone && (!spatial::is_valid(read.X_BD) || !spatial::is_finite(read.V_BD_B)))
    found = Fault::kDeviceNotFinite;
  if (found == Fault::kNone && is_too_fast) found = Fault::kDeviceTooFast;
  if (found != Fault::kNone) latch(found);
  const bool is_enabled = read.stage == devices::Stage::kEnabled;
  takes_hold_ = is_enabled && !was_enabled_ && wanted_N_ > kPulls_N;
  was_enabled_ = is_enabled;
  // It is there again, or it gave more than it took, and a hand has taken hold of it anew.
  if (is_enabled && (fault() == Fault::kDeviceSilent || fault() == Fault::kDeviceGivesWork)) {
    forget_fault();
    takes_hold_ = true;
  }
  if (found == Fault::kNone && !is_device_fault(fault())) {
    X_WD_ = settings_.X_WB * handle_.next(read.X_BD, dt_s);
    V_WD_W_ = {spatial::rotate(settings_.X_WB, read.V_BD_B.angular_rad_s),
               spatial::rotate(settings_.X_WB, read.V_BD_B.linear_m_s)};
    is_clutch_held_ = read.is_clutch_held;
    is_handle_known_ = true;
  } else {
    V_WD_W_ = {};
    handle_.forget();
  }
}

/// What changes at the remote begins at the same scene time here and there, if it was told in time.
void HapticLoop::take_courses(double scene_s) noexcept {
  motion::ObjectCourse told;
  for (int i = 0; i < kMostCoursesATick && remote_.take_course(told); ++i) {
    if (const motion::Moved* const moved = moving_.find(told.object))
      told.course = motion::caught_up(told.course, moving_.at(*moved, scene_s), scene_s);
    (void)moving_.set_out(told);
    if (contacts_) contacts_->set_out(told);
  }
}

void HapticLoop::receive(std::int64_t now_ns, TickRecord& record) noexcept {
  if (!remote_.poll(newest_)) return;
  // Subtraction form: right across the sequence's wrap.
  const auto ahead = static_cast<std::int32_t>(newest_.pose_sequence - answered_sequence_);
  const std::int64_t arrived_ns = scene_ns(now_ns);
  const bool answers_unsent = static_cast<std::int32_t>(newest_.pose_sequence - sequence_) >= 0 ||
                              newest_.pose_time_ns < 0 || newest_.pose_time_ns > arrived_ns;
  if ((has_answer_ && ahead <= 0) || answers_unsent) {
    ++sets_out_of_order_;
    return;
  }
  if (!local_model::is_usable(newest_)) {
    latch(Fault::kContactsNotUsable);
    return;
  }
  has_answer_ = true;
  answered_sequence_ = newest_.pose_sequence;
  record.rtt_ms = static_cast<double>(arrived_ns - newest_.pose_time_ns) * 1e-6;
  round_trip_ms_ += kRoundTripShare * (record.rtt_ms - round_trip_ms_);
  local_model::drop_absent(newest_, moving_);
  if (contacts_) contacts_->hear(newest_);
  if (line_end_ || (contacts_ && !pace_.is_resting())) {
    local_model_.hear(newest_, 1e-3 * record.rtt_ms);
  } else {
    local_model_.update(newest_, touching_.tool.X_WT, 1e-3 * record.rtt_ms);
  }
}

void HapticLoop::feel_surfaces(const realtime::TickTiming& timing, double dt_s, TickRecord& record) noexcept {
  const auto period_ns = static_cast<double>(settings_.timing.period_ns);
  const TilesPace::Tick tick = pace_.next(static_cast<double>(timing.previous_work_ns) / period_ns, 1e-9 * period_ns,
                                          settings_.tiles_may_rest && round_trip_ms_ < kFresh_ms);
  const bool has_tiles = local_model_.rung() == local_model::Rung::kTiles;
  const bool is_paced = !ablated(Mechanism::kTilesPace);
  if (is_paced && tick == TilesPace::Tick::kRests) {  // contacts are taken over as they arrive
    rung_felt_ = static_cast<std::uint8_t>(has_tiles ? local_model::Rung::kLinear : local_model_.rung());
    record.is_resting = true;
  } else if (is_paced && tick == TilesPace::Tick::kSpared) {
    ++ticks_spared_;
  } else {
    contact_service::ToolPose now{sequence_, scene_ns(timing.deadline_ns + timing.wake_ns), touching_.tool.X_WT,
                                  touching_.tool.V_WT_W};
    if (local_model_.has_rows()) now.X_WT = local_model_.where_to_look(touching_, dt_s);
    const double ahead_s = local_model_.ahead_s(touching_.tool.X_WT, touching_.tool.V_WT_W, dt_s);
    const local_model::TickContacts& here =
        has_tiles ? contacts_->ahead_of(now, ahead_s) : contacts_->beside_remote_ahead_of(now, ahead_s);
    if (!local_model::is_usable(here.set)) {
      latch(Fault::kContactsNotUsable);
      return;
    }
    local_model_.refresh(here, touching_.tool.X_WT);
    rung_felt_ =
        static_cast<std::uint8_t>(has_tiles && here.lacking > 0 ? local_model::Rung::kLinear : local_model_.rung());
  }
  record.rung = rung_felt_;
}

LoopState HapticLoop::next_state(std::uint32_t pressing, double dt_s) noexcept {
  untouched_s_ = pressing > 0 ? 0 : untouched_s_ + dt_s;
  if (fault() != Fault::kNone) return LoopState::kFault;
  fresh_s_ = local_model_.freshness() == local_model::Freshness::kFresh ? fresh_s_ + dt_s : 0;
  if (is_paused_) return LoopState::kPaused;
  switch (local_model_.freshness()) {
    case local_model::Freshness::kNone:
    case local_model::Freshness::kExpired:
      return LoopState::kFading;
    case local_model::Freshness::kHeld:
      return state() == LoopState::kFading ? LoopState::kFading : LoopState::kHeld;
    case local_model::Freshness::kFresh:
      // One datagram that came through is not the end of a silence.
      if ((state() == LoopState::kHeld || state() == LoopState::kFading) && fresh_s_ < kFreshAgain_s) return state();
      break;
  }
  const bool was_touching = state() == LoopState::kTouching;
  return pressing > 0 || (was_touching && untouched_s_ < kUntouched_s) ? LoopState::kTouching : LoopState::kFree;
}

/// Moves the tool by springs of contacts.
local_model::Felt HapticLoop::press_springs(double dt_s, TickRecord& record) noexcept {
  const local_model::Felt felt = local_model_.evaluate(touching_.tool.X_WT, touching_.tool.V_WT_W, dt_s);
  tool::LinearResponse forces =
      coupling_.evaluate(gear_.X_WI(), gear_.V_WI_W(), touching_.tool.X_WT, touching_.tool.V_WT_W).on_tool;
  forces += felt.response;
  const tool::StepWork stepped = tool::step(touching_.tool, forces, dt_s, settings_.integrator);
  touching_.X_WP = touching_.tool.X_WT;
  if (!is_tool_sane()) return felt;
  const spatial::Vector6 applied = tool::applied_wrench(felt.response, stepped, dt_s);
  local_model_.tell_pushes(felt, stepped, record.pushes);
  local_model_.settle(applied, stepped.V_moved, dt_s, touching_.tool.X_WT);
  record.F_contact_To_W = spatial::wrench_from(applied);
  return felt;
}

/// Moves the tool against rows, and its proxy along the surface.
local_model::Felt HapticLoop::press_pad(double dt_s, TickRecord& record) noexcept {
  const constraint::Law law = constraint::one_pad(coupling_.gains().stiffness_N_per_m);
  const std::span<const constraint::Row> rows = local_model_.rows(touching_, dt_s);
  const tool::LinearResponse pull =
      coupling_.evaluate(gear_.X_WI(), gear_.V_WI_W(), touching_.tool.X_WT, touching_.tool.V_WT_W).on_tool;
  const spatial::Pose X_WQ = touching_.X_WP;
  const constraint::TickReport report = constraint::take_tick(touching_, pull, rows, X_WQ, dt_s, law,
                                                              local_model_.tank().available_J(), settings_.integrator);
  if (!is_tool_sane()) return {};
  record.F_contact_To_W = spatial::wrench_from(report.contacts.F_To_W);
  return local_model_.settle(touching_, report, dt_s, record.pushes);
}

bool HapticLoop::is_tool_sane() noexcept {
  if (spatial::is_valid(touching_.tool.X_WT) && spatial::is_finite(touching_.tool.V_WT_W) &&
      spatial::is_valid(touching_.X_WP))
    return true;
  latch(Fault::kToolNotFinite);
  touching_.tool.X_WT = coupling_.rest_pose(gear_.X_WI());
  touching_.tool.V_WT_W = {};
  touching_ = constraint::untouched(touching_.tool);
  return false;
}

/// Moves the tool between coupling and local model; returns what the coupling does to the handle's image.
spatial::Wrench HapticLoop::render_local_model(double dt_s, TickRecord& record) noexcept {
  const local_model::Felt felt = local_model_.has_rows() ? press_pad(dt_s, record) : press_springs(dt_s, record);
  record.depth_max_m = felt.depth_max_m;
  record.contacts = felt.pressing;
  record.by_outline = felt.by_outline;
  record.outline_off_m = felt.outline_off_m;
  record.contact_energy_J = felt.energy_J;
  // The reaction at the end of the step, not at its beginning: a tick less delay.
  const tool::VirtualCoupling::State coupling =
      coupling_.evaluate(gear_.X_WI(), gear_.V_WI_W(), touching_.tool.X_WT, touching_.tool.V_WT_W);
  record.coupling_energy_J = coupling.energy_J;
  return coupling.F_hand_W;
}

/// The tool follows the handle's image, or what the remote says of the one that it simulates; returns what the line
/// does to the image. What is not fresh any more is not felt: a stale wrench, or wave, least of all.
spatial::Wrench HapticLoop::render_line(double dt_s, TickRecord& record) noexcept {
  const spatial::Pose X_rest = coupling_.rest_pose(gear_.X_WI());
  const glm::dvec3 p_ITo_W = X_rest.p - gear_.X_WI().p;
  const spatial::Twist V_rest{gear_.V_WI_W().angular_rad_s, spatial::velocity_at(gear_.V_WI_W(), p_ITo_W)};
  teleoperation::LineValue arrived;
  if (local_model_.freshness() == local_model::Freshness::kFresh) {
    arrived = remote_.line();
    if (!line_end_->is_tool_remote()) arrived.value = spatial::to_vector6(newest_.F_To_W);
  }
  const auto step = line_end_->tick(spatial::to_vector6(V_rest), arrived, dt_s);
  line_out_ = step.out;
  touching_.tool.X_WT = line_end_->is_tool_remote() && has_answer_ ? newest_.X_WT : X_rest;
  touching_.tool.V_WT_W = V_rest;
  touching_.X_WP = touching_.tool.X_WT;
  const spatial::Wrench F_To_W = spatial::wrench_from(step.F_hand);
  record.F_contact_To_W = F_To_W;
  record.rung = 0;
  for (std::uint32_t i = 0; i < newest_.count; ++i) {
    record.depth_max_m = std::max(record.depth_max_m, newest_.contacts[i].depth_m);
    record.contacts += newest_.contacts[i].depth_m > 0 ? 1 : 0;
  }
  return {F_To_W.torque_Nm + glm::cross(p_ITo_W, F_To_W.force_N), F_To_W.force_N};
}

/// Force goes, or comes again: after a silence of the remote, a fault, or a clutch.
bool HapticLoop::is_settling() const noexcept {
  return local_model_.freshness() != local_model::Freshness::kFresh || state() == LoopState::kHeld ||
         state() == LoopState::kFading || fault() != Fault::kNone || limiter_.is_ramping() || gear_.engagement() < 1;
}

double HapticLoop::pull_on_hand_N() const noexcept {
  const auto coupling = coupling_.evaluate(gear_.X_WI(), gear_.V_WI_W(), touching_.tool.X_WT, touching_.tool.V_WT_W);
  return glm::length(gear_.on_hand(coupling.F_hand_W).force_N);
}

void HapticLoop::tick(const realtime::TickTiming& timing) noexcept {
  const std::int64_t time_ns = timing.deadline_ns;
  const std::int64_t now_ns = time_ns + timing.wake_ns;
  // By when ticks began, as the handle is read then: by deadlines, one that woke late would pull the tool too little.
  const double gap_s = has_started_ ? static_cast<double>(now_ns - last_ns_) * 1e-9
                                    : static_cast<double>(settings_.timing.period_ns) * 1e-9;
  const double dt_s = std::clamp(gap_s, 1e-5, kMaxStep_s);

  const bool is_armed_anew = obey();
  read_device(now_ns, gap_s);
  if (!is_placed_ && is_handle_known_) {
    is_placed_ = true;
    gear_.start(X_WD_);
    X_WI_start_ = gear_.X_WI();
    touching_.tool.X_WT = touching_.X_WP = coupling_.rest_pose(gear_.X_WI());
  } else if (is_armed_anew || takes_hold_) {
    // Without force the hand may go deep into a surface: the tool does not follow it there, and nothing waits for the
    // reset, or the end of a pause, to push it out with.
    gear_.take_hold(X_WD_, touching_.tool.X_WT * settings_.X_TG);
  }
  gear_.advance(X_WD_, V_WD_W_, is_clutch_held_, dt_s, is_paused_ || fault() != Fault::kNone);
  // The hand went on through a stall, the tool did not: rather than to be flung after it with all force that there is,
  // the tool is taken hold of anew.
  if (gap_s > kStall_s && pull_on_hand_N() > device_.capabilities().max_force_N)
    gear_.take_hold(X_WD_, touching_.tool.X_WT * settings_.X_TG);
  const spatial::Pose X_WI_rest = touching_.tool.X_WT * settings_.X_TG;
  if (is_recentring_)
    is_recentring_ = !gear_.lead_to(X_WI_start_, X_WI_rest, dt_s);
  else
    gear_.relax_towards(X_WI_rest, dt_s);
  // Its image goes along with a tool that nobody holds: nothing else would stop it. Only takes energy out.
  if (gear_.engagement() == 0) {
    const double left = std::exp(-dt_s / kComesToRest_s);
    touching_.tool.V_WT_W = {left * touching_.tool.V_WT_W.angular_rad_s, left * touching_.tool.V_WT_W.linear_m_s};
  }
  if (!has_started_) {
    has_started_ = true;
    start_ns_ = time_ns;
  }
  last_ns_ = now_ns;

  TickRecord record;
  const double scene_s = 1e-9 * static_cast<double>(scene_ns(now_ns));
  take_courses(scene_s);
  moving_.go_to(scene_s);
  local_model_.go_along(moving_, touching_.tool.X_WT);
  local_model_.advance(gap_s, touching_.tool.X_WT);
  receive(now_ns, record);
  record.rung = static_cast<std::uint8_t>(local_model_.rung() == local_model::Rung::kTiles ? local_model::Rung::kLinear
                                                                                           : local_model_.rung());
  if (contacts_ && local_model_.is_refreshed()) feel_surfaces(timing, dt_s, record);
  if (local_model_.lost_while_deep() > contacts_lost_) {
    contacts_lost_ = local_model_.lost_while_deep();
    latch(Fault::kContactLost);
  }

  const spatial::Wrench F_I_W = line_end_ ? render_line(dt_s, record) : render_local_model(dt_s, record);
  const spatial::Wrench F_wanted_W = gear_.on_hand(F_I_W);
  wanted_N_ = glm::length(F_wanted_W.force_N);
  record.masked_torque_Nm =
      device_.capabilities().torque_dof == 0 ? glm::length(F_wanted_W.torque_Nm) : device_.masked_torque_Nm();
  returns_ =
      state() == LoopState::kFading && (returns_ || local_model_.freshness() == local_model::Freshness::kExpired);
  const spatial::Wrench F_limited_W = limiter_.limited(F_wanted_W, V_WD_W_, dt_s, returns_);
  const Circumstances circumstances{
      .given_J = settings_.scales.torque() * (local_model_.script_work_J() - script_work_told_J_),
      .moving_J = settings_.scales.torque() * tool::kinetic_energy_J(touching_.tool),
      .is_settling = is_settling()};
  script_work_told_J_ = local_model_.script_work_J();
  const spatial::Wrench F_hand_B = device_.render({spatial::rotate_back(settings_.X_WB, F_limited_W.torque_Nm),
                                                   spatial::rotate_back(settings_.X_WB, F_limited_W.force_N)},
                                                  circumstances);
  record.F_hand_W = {spatial::rotate(settings_.X_WB, F_hand_B.torque_Nm),
                     spatial::rotate(settings_.X_WB, F_hand_B.force_N)};
  remote_.send({sequence_++, scene_ns(now_ns), touching_.X_WP, touching_.tool.V_WT_W, line_out_});

  const LoopState state = next_state(record.contacts, gap_s);
  state_.store(state, std::memory_order_relaxed);
  record.number = ticks_++;
  record.time_ns = time_ns - start_ns_;
  record.X_WI = gear_.X_WI();
  record.X_WT = touching_.X_WP;
  record.pairs = newest_.pairs_near;
  record.wake_us = static_cast<float>(static_cast<double>(timing.wake_ns) * 1e-3);
  record.work_us = static_cast<float>(static_cast<double>(timing.previous_work_ns) * 1e-3);
  record.state = state;
  record.ticks_missed = timing.missed;
  record.tank_J = local_model_.tank().level_J();
  record.contact_port_J = local_model_.contact_port().energy_J();
  record.script_work_J = local_model_.script_work_J();
  record.device_observer_J = device_.hand_energy_J();
  records_.push(record);
}

void HapticLoop::run(const std::atomic<bool>& stop) {
  realtime::run_periodically(settings_.timing, stop, statistics_,
                             [this](const realtime::TickTiming& timing) { tick(timing); });
}

}  // namespace farfeel::master_station
