// What the haptic loop needs of a device: where the handle is, and a wrench for the hand.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string_view>

#include "haptic_core/spatial/spatial.h"
#include "master_station/devices/link/sample.h"

namespace farfeel::master_station {

/// What a device can do. It never claims what it lacks: 0 degrees of freedom of force means it cannot push.
struct DeviceCapabilities {
  std::string_view name;
  int pose_dof = 6, force_dof = 3, torque_dof = 3;
  double max_force_N = 0, max_torque_Nm = 0;
  double max_force_rate_N_per_s = 0;  ///< what its amplifiers and the hand take without a click
  double max_power_W = 0;             ///< mechanical, given to the hand
  double max_speed_m_s = 0;           ///< beyond it, something broke
  /// Of its readings, along and about each axis of its base; 0: too fine to matter, or not known.
  double position_step_m = 0, rotation_step_rad = 0;
  /// The stiffest spring, with its damping, that the device renders stably at a 1 ms tick. Where it gives no force, or
  /// no torque, that axis bounds nothing and its figures are not used.
  double stable_stiffness_N_per_m = 0, stable_damping_Ns_per_m = 0;
  double stable_rotational_stiffness_Nm_per_rad = 0, stable_rotational_damping_Nms_per_rad = 0;
  /// From a movement to the force that answers it, and how long its own exchange holds a force; 0: no longer than the
  /// tick.
  double delay_s = 0, exchange_s = 0;
  /// Half of what holds a force, and the delay: a stable stiffness goes with its inverse.
  [[nodiscard]] double late_ns(double tick_ns) const noexcept {
    return 0.5 * std::max(tick_ns, 1e9 * exchange_s) + 1e9 * delay_s;
  }
};

/// Why a device is without force by itself, until it is reset.
enum class DeviceFault : std::uint8_t {
  kNone,
  kSilent,        ///< unplugged, or its newest reading is too old
  kNotFinite,     ///< a reading, or a wrench for it
  kTooFast,       ///< beyond max_speed_m_s
  kGivesWork,     ///< its force drives the hand on and on
  kGoesElsewhere  ///< it does not move where its force pushes: an axis is swapped, or has the wrong sign
};

/// The handle D in the device's base frame B.
struct DeviceState {
  spatial::Pose X_BD;
  spatial::Twist V_BD_B;        ///< of D's origin, estimated by the driver
  bool is_live = true;          ///< false: unplugged or silent; the pose is the last one known
  bool is_clutch_held = false;  ///< the button that lets the handle move without the tool
  devices::Stage stage = devices::Stage::kReady;
  DeviceFault fault = DeviceFault::kNone;
  std::uint32_t buttons = 0;  ///< bit i: button i is down
  std::uint32_t opening = 0;  ///< another number is another plugging in
  /// Another number: from here on the handle is mapped otherwise (clutch, scale, recentring, another device).
  std::uint32_t mapping = 0;
  std::int64_t time_ns = 0;  ///< when this was true, or the device last seen; 0: at the time asked for
};

/// What the caller knows of a wrench that it renders.
struct Circumstances {
  /// The work that moving objects did on the hand since the last tick.
  double given_J = 0;
  /// What the simulated tool's motion holds now, as the hand would feel it.
  double moving_J = 0;
  /// The force is being faded, ramped or taken hold of anew: what the handle does then tells nothing of its axes.
  bool is_settling = false;
};

/// Used by the haptic thread alone, from inside a tick: no call may block, allocate, lock, throw or log.
class Device {
 public:
  virtual ~Device() = default;

  [[nodiscard]] virtual const DeviceCapabilities& capabilities() const noexcept = 0;
  /// The newest state at or before time_ns (CLOCK_MONOTONIC; simulated devices live by it).
  [[nodiscard]] virtual DeviceState read(std::int64_t time_ns) noexcept = 0;
  /// The wrench on the hand about D's origin, until the next write. The caller has clamped it to the capabilities.
  virtual void write(const spatial::Wrench& F_hand_B) noexcept = 0;

  /// The same, and what of it the hand really gets.
  [[nodiscard]] virtual spatial::Wrench render(const spatial::Wrench& F_hand_B, const Circumstances&) noexcept {
    write(F_hand_B);
    return F_hand_B;
  }
  /// A person at the station resets what went wrong. That arms the device; force comes with an edge of its own button.
  virtual void reset() noexcept {}
  /// Nobody feels the device now: where its pose is a sum of motions, the sum may begin anew.
  virtual void recentre() noexcept {}

  /// Of the newest wrench, the torque that nothing renders though capabilities() takes it.
  [[nodiscard]] virtual double masked_torque_Nm() const noexcept { return 0; }
  /// Energy the hand has put into the device, less what it got back [J]; NaN when nobody can know.
  [[nodiscard]] virtual double hand_energy_J() const noexcept { return std::numeric_limits<double>::quiet_NaN(); }
};

}  // namespace farfeel::master_station
