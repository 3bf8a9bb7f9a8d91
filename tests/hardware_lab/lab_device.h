// A device of the lab: emulated hardware that can be plugged in and pulled out, with a simulated hand on it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace farfeel::hardware_lab {

class LabDevice {
 public:
  virtual ~LabDevice() = default;

  /// What --device takes.
  [[nodiscard]] virtual std::string argument() const = 0;
  /// More arguments of farfeel-master that this device needs.
  [[nodiscard]] virtual std::vector<std::string> more_arguments() const { return {}; }
  /// The node that the person opens, "/dev/bus/usb/001/007"; empty: not there, or none is opened.
  [[nodiscard]] virtual std::string node() const = 0;

  /// udev's rule is what lets a person open it; else a service does.
  [[nodiscard]] virtual bool needs_rule() const { return true; }

  virtual void plug_in() = 0;
  /// The same with ids that are nobody's. False: this bus has none.
  virtual bool plug_in_as_stranger() { return false; }
  /// Returns CLOCK_MONOTONIC before the kernel's disconnect began.
  virtual std::int64_t pull_out() = 0;

  /// What a person does with it until it is ready, at `t_s` after it was plugged in; called every now and then.
  virtual void make_ready(double /*t_s*/) {}
  /// The hand: it rests where the device is plugged in; it lifts the handle to where it takes hold, which may take a
  /// while; it grips (deadman, button); it presses into whatever is below, or pushes a rate input down.
  virtual void rest() = 0;
  virtual void lift() { rest(); }
  virtual void grip(bool is_held) = 0;
  virtual void press_down() = 0;
  /// It has no button: a key held at the station's terminal stands for the grip, and grip() does nothing.
  [[nodiscard]] virtual bool has_key_at_station() const { return false; }

  /// Whether it has motors; their force on the hand as the emulator itself has it, now [N].
  [[nodiscard]] virtual bool has_force() const = 0;
  [[nodiscard]] virtual double force_N() = 0;
  /// How long its own watchdog let the last force stand [s]; nothing: it did not have to act.
  [[nodiscard]] virtual std::optional<double> watchdog_s() { return std::nullopt; }
  /// How often it took force off by itself.
  [[nodiscard]] virtual int own_watchdog_trips() { return 0; }
  /// Its endpoints refuse from now on, until it is pulled out. False: no such thing on this bus.
  virtual bool stall() { return false; }
};

[[nodiscard]] std::unique_ptr<LabDevice> make_space_mouse();
[[nodiscard]] std::unique_ptr<LabDevice> make_falcon();
[[nodiscard]] std::unique_ptr<LabDevice> make_wooden_haptics();
[[nodiscard]] std::unique_ptr<LabDevice> make_joystick();
[[nodiscard]] std::unique_ptr<LabDevice> make_inverse3();

}  // namespace farfeel::hardware_lab
