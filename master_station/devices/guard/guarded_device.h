// The one safety decorator around any device, simulated ones too. It alone decides whether force is on, and how much.
//
//   device ⇄ [ deadman, velocity, silence, axes, walls, ramps, heat, work, cap ] ⇄ loop
//
// Force comes only with an edge of the device's own button (or of the key held at the station, where it has none), and
// goes with whatever is wrong; then a reset arms it, and the next edge brings it back. Whatever is asked, the hand gets
// no more than the cap, and no step beyond the ramps.
#pragma once

#include <atomic>

#include "master_station/devices/device.h"
#include "master_station/devices/guard/axis_probe.h"
#include "master_station/devices/guard/deadman.h"
#include "master_station/devices/guard/thermal_limit.h"
#include "master_station/devices/guard/work_watch.h"
#include "master_station/devices/guard/workspace_wall.h"
#include "master_station/devices/model/coupling_rule.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

struct GuardSettings {
  DeviceModel model;
  Grasp hand = Grasp::kAny;
  double max_force_N = 0;    ///< cap; 0: the smaller of kDefaultCap_N and what the device gives continuously
  double max_torque_Nm = 0;  ///< cap; 0: what the device gives continuously
  /// A serial number, or a calibration, that was never felt: its axes are tried at its first grip, and it begins
  /// softly.
  bool is_new_device = false;
  glm::dvec3 gravity_B_N{0};           ///< added while force is on, under the cap
  std::int64_t period_ns = 1'000'000;  ///< of the loop
};

/// read(), write(), render() and reset() are the haptic thread's, and realtime-safe.
class GuardedDevice final : public master_station::Device {
 public:
  static constexpr double kDefaultCap_N = 8;
  static constexpr double kRise_s = 0.2;     ///< to full force, from an edge
  static constexpr double kRelease_s = 0.1;  ///< to zero, from its release
  static constexpr double kStop_s = 0.02;    ///< to zero, when something is wrong
  static constexpr double kGentle_N = 0.2;   ///< most step of a tick for kGentle_s after the handle is mapped anew
  static constexpr double kGentle_s = 0.25;
  static constexpr double kFirstShare = 0.2, kFirst_s = 2;  ///< of force, and seconds of contact until it is all
  static constexpr double kSettled_s =
      0.1;  ///< after what tells nothing of the device is over: the work watch begins anew

  /// The device outlives it.
  GuardedDevice(master_station::Device& device, const GuardSettings& settings);
  /// Zero force. The loop has ended; it ramped down by itself if it was let.
  ~GuardedDevice() override;
  GuardedDevice(const GuardedDevice&) = delete;
  GuardedDevice& operator=(const GuardedDevice&) = delete;

  /// The greatest force and torque are the caps.
  [[nodiscard]] const master_station::DeviceCapabilities& capabilities() const noexcept override {
    return capabilities_;
  }
  [[nodiscard]] master_station::DeviceState read(std::int64_t time_ns) noexcept override;
  void write(const spatial::Wrench& F_hand_B) noexcept override { (void)render(F_hand_B, {}); }
  [[nodiscard]] spatial::Wrench render(const spatial::Wrench& F_hand_B,
                                       const master_station::Circumstances&) noexcept override;
  void reset() noexcept override;
  [[nodiscard]] double hand_energy_J() const noexcept override { return device_.hand_energy_J(); }

  // Any thread:
  /// From now on force goes to zero and stays there: before the end.
  void stop() noexcept { is_stopped_.store(true, std::memory_order_relaxed); }
  /// Of a device that has no button: the station's key, or a foot switch, is held until then (CLOCK_MONOTONIC), as far
  /// as is known now. To be told again while it is held, so that a station that hangs lets go.
  void hold_station_key_until(std::int64_t time_ns) noexcept {
    key_held_until_ns_.store(time_ns, std::memory_order_relaxed);
  }
  [[nodiscard]] Stage stage() const noexcept { return stage_.load(std::memory_order_relaxed); }
  /// The button, or the station's key, is down: where that gives no force, it has to go up first.
  [[nodiscard]] bool is_held() const noexcept { return is_held_.load(std::memory_order_relaxed); }
  [[nodiscard]] master_station::DeviceFault fault() const noexcept { return fault_.load(std::memory_order_relaxed); }
  /// It was felt long enough to be remembered.
  [[nodiscard]] bool is_trusted() const noexcept { return is_trusted_.load(std::memory_order_relaxed); }

  // When the loop does not run:
  [[nodiscard]] const WorkWatch& work() const noexcept { return work_; }
  [[nodiscard]] const AxisProbe& axes() const noexcept { return axes_; }

 private:
  [[nodiscard]] master_station::DeviceFault found_in(const master_station::DeviceState&, std::int64_t time_ns) noexcept;
  void latch(master_station::DeviceFault) noexcept;
  [[nodiscard]] spatial::Wrench possible(const spatial::Wrench&) const noexcept;
  void advance_gain(bool is_on) noexcept;
  [[nodiscard]] double first_share(double force_N) noexcept;
  [[nodiscard]] bool is_trying_axes() const noexcept {
    return settings_.is_new_device && axes_.verdict() == AxisProbe::Verdict::kOpen;
  }
  void watch_work(const master_station::DeviceState&, bool is_watched) noexcept;
  void try_axes(const master_station::DeviceState&, bool is_held) noexcept;

  master_station::Device& device_;
  GuardSettings settings_;
  master_station::DeviceCapabilities capabilities_;
  WorkspaceWall wall_;
  Deadman deadman_;
  ThermalLimit heat_;
  WorkWatch work_;
  AxisProbe axes_;

  std::int64_t last_ns_ = 0;
  double dt_s_ = 0;
  bool has_read_ = false, stops_ = false;
  master_station::DeviceState state_;   // the last that was good
  master_station::Circumstances told_;  // with the last wrench
  double settled_s_ = 0;                // since the last that tells nothing of the device
  bool gave_work_ = false;              // and waits for a grip
  double gain_ = 0, stop_s_ = kStop_s, gentle_s_ = 0, trust_ = 1;
  glm::dvec3 F_axes_wanted_B_N_{0}, F_axes_B_N_{0};
  spatial::Wrench F_wanted_B_, F_slewed_B_, F_written_B_;
  glm::dvec3 F_walls_B_N_{0}, F_gravity_B_N_{0};  // parts of what was written

  std::atomic<bool> is_stopped_{false}, is_trusted_{false}, is_held_{false};
  std::atomic<std::int64_t> key_held_until_ns_{0};
  std::atomic<Stage> stage_{Stage::kAbsent};
  std::atomic<master_station::DeviceFault> fault_{master_station::DeviceFault::kNone};
};

}  // namespace farfeel::devices
