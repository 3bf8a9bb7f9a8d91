#include "tests/support/devices/force_joystick_emulator.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <numbers>

namespace farfeel::devices {
namespace {

constexpr int kAxisMin = -32768, kAxisMax = 32767;
constexpr std::int64_t kStep_ns = 500'000;

}  // namespace

int ForceJoystickEmulator::upload(ff_effect& effect) {
  ++uploads_;
  if (effect.type != FF_CONSTANT) return EINVAL;
  if (effect.id == -1) {
    const auto free = std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return !slot.is_used; });
    if (free == slots_.end()) return ENOSPC;
    effect.id = static_cast<std::int16_t>(free - slots_.begin());
    *free = {.is_used = true, .is_playing = false, .effect = effect, .played_ns = 0};
    return 0;
  }
  if (effect.id < 0 || effect.id >= kEffects || !slots_[static_cast<std::size_t>(effect.id)].is_used) return EINVAL;
  slots_[static_cast<std::size_t>(effect.id)].effect = effect;
  return 0;
}

int ForceJoystickEmulator::erase(int id) {
  if (id < 0 || id >= kEffects || !slots_[static_cast<std::size_t>(id)].is_used) return EINVAL;
  slots_[static_cast<std::size_t>(id)] = {};
  return 0;
}

void ForceJoystickEmulator::write(std::uint16_t type, std::uint16_t code, std::int32_t value) {
  if (type != EV_FF) return;
  if (code == FF_GAIN) gain_ = double(std::clamp(value, 0, 65535)) / 65535;
  if (code == FF_AUTOCENTER) autocenter_ = double(std::clamp(value, 0, 65535)) / 65535;
  if (code >= kEffects || !slots_[code].is_used) return;
  slots_[code].is_playing = value > 0;
  slots_[code].played_ns = now_ns_;
  plays_ += value > 0;
}

std::array<double, 2> ForceJoystickEmulator::effect_force_N() const {
  std::array<double, 2> sum_N{};
  for (const Slot& slot : slots_) {
    const std::int64_t length_ns = std::int64_t{slot.effect.replay.length} * 1'000'000;
    if (!slot.is_playing || (length_ns > 0 && now_ns_ - slot.played_ns > length_ns)) continue;
    const double force_N = mechanics_.full_force_N * gain_ * slot.effect.u.constant.level / 32767;
    // From down (towards the person) over left: clockwise, seen from above.
    const double angle_rad = 2 * std::numbers::pi * slot.effect.direction / 65536;
    sum_N[0] += force_N * -std::sin(angle_rad);
    sum_N[1] += force_N * std::cos(angle_rad);
  }
  if (axes_ < 2) sum_N[1] = 0;
  return sum_N;
}

void ForceJoystickEmulator::advance_to(std::int64_t now_ns) {
  if (now_ns_ == 0 || now_ns - now_ns_ > 1'000'000'000) now_ns_ = now_ns;
  const auto& is = mechanics_;
  for (; now_ns_ + kStep_ns <= now_ns; now_ns_ += kStep_ns) {
    const auto effect_N = effect_force_N();
    for (std::size_t i = 0; i < static_cast<std::size_t>(axes_); ++i) {
      const double force_N = effect_N[i] + hand_N_[i] - is.stiffness_N_per_m * p_m_[i] -
                             is.damping_Ns_per_m * v_m_s_[i] -
                             autocenter_ * is.full_force_N * std::clamp(p_m_[i] / is.travel_m, -1.0, 1.0);
      v_m_s_[i] += 1e-9 * kStep_ns * force_N / is.mass_kg;
      p_m_[i] += 1e-9 * kStep_ns * v_m_s_[i];
      if (std::abs(p_m_[i]) > is.travel_m) p_m_[i] = std::copysign(is.travel_m, p_m_[i]), v_m_s_[i] = 0;
    }
  }
  bool is_new = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(axes_); ++i) {
    const int value = static_cast<int>(std::lround(p_m_[i] / is.travel_m * kAxisMax));
    if (value == told_[i]) continue;
    told_[i] = value;
    tell(EV_ABS, static_cast<std::uint16_t>(ABS_X + i), value);
    is_new = true;
  }
  if (is_new) tell(EV_SYN, SYN_REPORT, 0);
}

std::optional<input_event> ForceJoystickEmulator::event() {
  if (events_.empty()) return std::nullopt;
  const input_event event = events_.front();
  events_.pop_front();
  return event;
}

void ForceJoystickEmulator::press(std::uint16_t key, bool is_down) {
  tell(EV_KEY, key, is_down ? 1 : 0);
  tell(EV_SYN, SYN_REPORT, 0);
}

input_absinfo ForceJoystickEmulator::axis(int i) const {
  input_absinfo info{};
  info.value = told_[static_cast<std::size_t>(i)];
  info.minimum = kAxisMin;
  info.maximum = kAxisMax;
  return info;
}

void ForceJoystickEmulator::tell(std::uint16_t type, std::uint16_t code, std::int32_t value) {
  input_event event{};
  event.input_event_sec = now_ns_ / 1'000'000'000;
  event.input_event_usec = now_ns_ % 1'000'000'000 / 1000;
  event.type = type, event.code = code, event.value = value;
  events_.push_back(event);
}

}  // namespace farfeel::devices
