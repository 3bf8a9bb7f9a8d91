#include "master_station/devices/driver/pid_joystick_driver.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

namespace farfeel::devices {
namespace {

constexpr int kEventsAtOnce = 256;  // what the kernel keeps for a reader of a joystick, and some
constexpr int kFullLevel = 32767;
constexpr int kFullGain = 65535;
constexpr std::uint16_t kRight = 0xC000;
constexpr std::int64_t kTryAgain_ns = 50'000'000;  // a refused set-up is some transfers on USB
// Played again before it ends, even if a step or two comes late.
constexpr std::int64_t kPlayAgain_ns = PidJoystickDriver::kEffectLength_ms * 1'000'000LL * 2 / 5;

std::vector<FoundDevice> find(const DriverOptions&) {
  std::vector<FoundDevice> found;
  for (const FoundEvdev& is : find_force_feedback())
    found.push_back({.model = "pid-joystick", .serial = is.serial, .path = is.path, .trouble = is.trouble});
  return found;
}

tl::expected<std::unique_ptr<Driver>, DeviceError> open_found(const FoundDevice& device, const DriverOptions&) {
  auto channel = open_evdev(device.path);
  if (!channel) return tl::unexpected(DeviceError{channel.error()});
  return PidJoystickDriver::open(std::move(*channel), device);
}

}  // namespace

const DriverFamily kPidJoystickFamily{"pid-joystick", find, open_found};

double PidJoystickDriver::Axis::share() const noexcept {
  const double middle = 0.5 * (double(minimum) + double(maximum));
  return std::clamp((double(value) - middle) / (double(maximum) - middle), -1.0, 1.0);
}

tl::expected<std::unique_ptr<Driver>, DeviceError> PidJoystickDriver::open(std::unique_ptr<EvdevChannel> channel,
                                                                           FoundDevice identity) {
  const auto refusal = [&](const char* why) { return tl::unexpected(DeviceError{identity.path + " " + why}); };
  if (!channel->has(EV_FF, FF_CONSTANT)) return refusal("has no effect of constant force");
  std::vector<Axis> axes;
  const auto add = [&](std::uint16_t code) {
    const auto info = channel->axis(code);
    if (info && info->maximum > info->minimum) axes.push_back({code, info->minimum, info->maximum, info->value});
    return info && info->maximum > info->minimum;
  };
  if (!add(ABS_X) && !add(ABS_WHEEL)) return refusal("has neither an x axis nor a wheel with a range");
  if (axes[0].code == ABS_X) add(ABS_Y);
  return std::unique_ptr<Driver>(new PidJoystickDriver(std::move(channel), std::move(identity), std::move(axes)));
}

PidJoystickDriver::PidJoystickDriver(std::unique_ptr<EvdevChannel> channel, FoundDevice identity,
                                     std::vector<Axis> axes)
    : channel_(std::move(channel)), identity_(std::move(identity)), axes_(std::move(axes)) {
  effect_.type = FF_CONSTANT;
  effect_.id = -1;
  effect_.direction = kRight;
  effect_.replay.length = kEffectLength_ms;
}

PidJoystickDriver::~PidJoystickDriver() {
  stop();
}

/// Gain, no spring of the device's own, and the effect, of level 0 and not playing.
bool PidJoystickDriver::set_up() noexcept {
  if (channel_->has(EV_FF, FF_AUTOCENTER)) note(channel_->write(EV_FF, FF_AUTOCENTER, 0));
  if (channel_->has(EV_FF, FF_GAIN)) note(channel_->write(EV_FF, FF_GAIN, kFullGain));
  effect_.u.constant.level = 0;
  const ChannelState state = channel_->upload(effect_);
  note(state);
  return state == ChannelState::kDone && effect_.id >= 0;
}

void PidJoystickDriver::note(ChannelState state) noexcept {
  is_gone_ = is_gone_ || state == ChannelState::kGone;
}

Stage PidJoystickDriver::step(std::int64_t deadline_ns, const Command& command, Sample& newest) {
  if (!command.is_force_on) is_force_to_wait_ = false;
  const std::int64_t now_ns = realtime::monotonic_now_ns();
  if (!is_set_up_ && !is_gone_ && !is_force_to_wait_ && now_ns - tried_ns_ >= kTryAgain_ns) {
    tried_ns_ = now_ns;
    is_set_up_ = set_up();
  }
  const bool is_meant = command.is_force_on && spatial::is_finite(command.F_hand_B.force_N);
  if (is_meant && is_set_up_ && !is_force_to_wait_ && !is_gone_) {
    push(command.F_hand_B.force_N, now_ns);
  } else {
    stop();
  }
  if (!is_gone_) read(deadline_ns);

  newest = Sample{};
  newest.stage = is_gone_ ? Stage::kAbsent : is_set_up_ ? Stage::kReady : Stage::kFault;
  newest.time_ns = time_ns_;
  newest.polled_ns = polled_ns_;
  newest.reports = reports_;
  newest.buttons = buttons_;
  newest.X_BD = pose();
  newest.V_BD_B = velocity_.twist();
  newest.deflection.push = newest.X_BD.p / kTravel_m;
  return newest.stage;
}

void PidJoystickDriver::read(std::int64_t deadline_ns) noexcept {
  for (int i = 0; i < kEventsAtOnce; ++i) {
    input_event event{};
    const ChannelState state = channel_->read(event, i == 0 ? deadline_ns : 0);
    note(state);
    if (state == ChannelState::kDone || state == ChannelState::kNothing) polled_ns_ = realtime::monotonic_now_ns();
    if (state != ChannelState::kDone) break;
    take(event);
  }
  // A stick that rests tells nothing, and is at rest: the estimate goes on with the same pose.
  if (!is_gone_) velocity_.update(pose(), polled_ns_);
}

void PidJoystickDriver::take(const input_event& event) noexcept {
  if (event.type == EV_ABS) {
    for (Axis& axis : axes_)
      if (axis.code == event.code) axis.value = event.value;
  } else if (event.type == EV_KEY && event.code >= BTN_JOYSTICK && event.code < BTN_JOYSTICK + 32) {
    const std::uint32_t bit = std::uint32_t{1} << (event.code - BTN_JOYSTICK);
    buttons_ = event.value != 0 ? buttons_ | bit : buttons_ & ~bit;
  } else if (event.type == EV_SYN && event.code == SYN_REPORT) {
    time_ns_ = polled_ns_;
    ++reports_;
  }
}

spatial::Pose PidJoystickDriver::pose() const noexcept {
  spatial::Pose X_BD;
  X_BD.p.x = axes_[0].share() * kTravel_m;
  if (axes_.size() > 1) X_BD.p.y = -axes_[1].share() * kTravel_m;  // it grows towards the person
  return X_BD;
}

// With the angle a from down over left, the effect pushes along x = -sin a, y = -cos a. One axis keeps its direction,
// and the level has the sign.
void PidJoystickDriver::push(const glm::dvec3& force_B_N, std::int64_t now_ns) noexcept {
  const double x = force_B_N.x / kFullForce_N, y = axes_.size() > 1 ? force_B_N.y / kFullForce_N : 0;
  const double share = axes_.size() > 1 ? std::min(std::hypot(x, y), 1.0) : std::clamp(x, -1.0, 1.0);
  const auto level = static_cast<std::int16_t>(std::lround(share * kFullLevel));
  if (level == 0) return stop();
  std::uint16_t direction = kRight;
  if (axes_.size() > 1) {
    const double turns = std::atan2(-x, -y) / (2 * std::numbers::pi);
    direction = static_cast<std::uint16_t>(std::lround(turns * 65536) & 0xFFFF);
  }
  const bool is_other = level != effect_.u.constant.level || direction != effect_.direction;
  if (is_other && now_ns - updated_ns_ >= kUpdate_ns) {
    effect_.u.constant.level = level;
    effect_.direction = direction;
    const ChannelState state = channel_->upload(effect_);
    updated_ns_ = now_ns;
    if (state != ChannelState::kDone) {
      note(state);
      is_set_up_ = false, is_force_to_wait_ = true;
      return stop();
    }
  } else if (is_other && !is_playing_) {
    return;  // what is uploaded is of before the last stop
  }
  if (is_playing_ && now_ns - played_ns_ < kPlayAgain_ns) return;
  const ChannelState state = channel_->write(EV_FF, static_cast<std::uint16_t>(effect_.id), 1);
  played_ns_ = now_ns;
  is_playing_ = true;
  if (state == ChannelState::kDone) return;
  note(state);
  is_set_up_ = false, is_force_to_wait_ = true;
  stop();
}

void PidJoystickDriver::stop() noexcept {
  if (!is_playing_ || effect_.id < 0 || is_gone_) return;
  const ChannelState state = channel_->write(EV_FF, static_cast<std::uint16_t>(effect_.id), 0);
  note(state);
  if (state == ChannelState::kDone) {
    is_playing_ = false;
  } else {  // tried again in the next step; the effect ends by itself
    is_set_up_ = false, is_force_to_wait_ = true;
  }
}

std::string PidJoystickDriver::advice() const {
  if (is_gone_) return "the joystick was unplugged";
  if (is_set_up_) return {};
  return "the joystick refuses its effect of constant force: close other programs that use it, or plug it in again";
}

std::optional<ZeroForce> PidJoystickDriver::zero_force() const {
  if (channel_->descriptor() < 0 || effect_.id < 0) return std::nullopt;
  input_event event{};
  event.type = EV_FF;
  event.code = static_cast<std::uint16_t>(effect_.id);
  ZeroForce zero{
      .fd = channel_->descriptor(), .how = ZeroForce::How::kWrite, .endpoint = 0, .size = sizeof event, .bytes = {}};
  static_assert(sizeof event <= sizeof zero.bytes);
  std::memcpy(zero.bytes.data(), &event, sizeof event);
  return zero;
}

}  // namespace farfeel::devices
