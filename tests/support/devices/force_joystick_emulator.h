// A joystick with force feedback as the kernel shows it (linux/input.h): axes, buttons, effects, and a stick on springs
// that the effects push. Byte in, byte out, no input or output of its own: a test drives it behind EvdevChannel, and a
// program with uinput can: its events are what uinput is to write, and its upload and erase what uinput asks for.
//
// Written from linux/input.h and the kernel's documentation of force feedback, before the driver:
//   direction 0x0000 pushes down (towards the person), 0x4000 left, 0x8000 up (away), 0xC000 right, one turn in all;
//   level -32767 to 32767; replay.length in ms, 0 for ever, counted from the last play; gain 0 to 65535, of all
//   effects; autocenter 0 to 65535: a spring that the device has on when it is switched on.
// Axis values grow to the right and towards the person.
#pragma once

#include <linux/input.h>

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

namespace farfeel::devices {

struct ForceJoystickMechanics {
  double full_force_N = 4;  ///< of an effect of level 32767
  double mass_kg = 0.1, stiffness_N_per_m = 100, damping_Ns_per_m = 4;
  double travel_m = 0.04;  ///< from the middle to each end
};

class ForceJoystickEmulator {
 public:
  using Mechanics = ForceJoystickMechanics;
  static constexpr int kEffects = 4;

  explicit ForceJoystickEmulator(int axes, Mechanics mechanics = {}) : axes_(axes), mechanics_(mechanics) {}

  /// 0, or an errno: EINVAL what is no constant force or has no such id, ENOSPC no room. Gives an id where it is -1.
  int upload(ff_effect& effect);
  int erase(int id);
  /// EV_FF of an effect's id, of FF_GAIN or FF_AUTOCENTER.
  void write(std::uint16_t type, std::uint16_t code, std::int32_t value);
  /// The stick moves on, under the springs, the effects and the hand.
  void advance_to(std::int64_t now_ns);
  /// The oldest event that waits.
  std::optional<input_event> event();

  void press(std::uint16_t key, bool is_down);
  /// A hand pushes [N], in the axes' own directions: to the right and towards the person.
  void push(double right_N, double towards_N) { hand_N_ = {right_N, towards_N}; }

  [[nodiscard]] int axes() const { return axes_; }
  [[nodiscard]] input_absinfo axis(int i) const;
  [[nodiscard]] std::array<double, 2> stick_m() const { return p_m_; }  ///< to the right, towards the person
  /// What all effects together push with, now [N].
  [[nodiscard]] std::array<double, 2> effect_force_N() const;
  [[nodiscard]] int uploads() const { return uploads_; }
  [[nodiscard]] int plays() const { return plays_; }
  [[nodiscard]] double gain() const { return gain_; }
  [[nodiscard]] double autocenter() const { return autocenter_; }

 private:
  struct Slot {
    bool is_used = false, is_playing = false;
    ff_effect effect{};
    std::int64_t played_ns = 0;
  };
  void tell(std::uint16_t type, std::uint16_t code, std::int32_t value);

  int axes_;
  Mechanics mechanics_;
  std::array<Slot, kEffects> slots_;
  std::deque<input_event> events_;
  std::array<double, 2> p_m_{}, v_m_s_{}, hand_N_{};
  std::array<int, 2> told_{};
  std::int64_t now_ns_ = 0;
  double gain_ = 0.5, autocenter_ = 0.3;
  int uploads_ = 0, plays_ = 0;
};

}  // namespace farfeel::devices
