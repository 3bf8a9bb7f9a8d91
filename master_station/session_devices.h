// The devices of a session: found, opened by farfeel-device, composed to one hand, guarded. Or the simulated one, under
// the same guard.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/contact/material.h"
#include "master_station/devices/driver/driver.h"
#include "master_station/devices/guard/guarded_device.h"
#include "master_station/devices/hand/hand.h"
#include "master_station/devices/hand/hand_choice.h"
#include "master_station/devices/hand/linked_device.h"
#include "master_station/devices/link/owner_process.h"
#include "master_station/devices/simulated_device.h"
#include "master_station/haptic_loop/handle_gear.h"
#include "master_station/station_key.h"

namespace farfeel::master_station {

struct DeviceWishes {
  devices::ChoiceWords choice;        ///< device may be one "simulated:MODEL", too: simulated with that model's figures
  SimulatedDeviceSettings simulated;  ///< hand and grip; its model is chosen here
  devices::DriverOptions options;
  double max_force_N = 0, max_torque_Nm = 0;  ///< caps; 0: by the guard's rule
  devices::Grasp grasp = devices::Grasp::kAny;
  GearScales scales;
  std::int64_t period_ns = 1'000'000;
};

class SessionDevices {
 public:
  using Tell = std::function<void(const std::string& sentence)>;

  /// Blocks until every device is ready, which a person may have to help with: `tell` says how. With nothing plugged in
  /// it is the simulated device. An error, too, once should_stop.
  [[nodiscard]] static tl::expected<std::unique_ptr<SessionDevices>, std::string> open(
      const DeviceWishes&, const Tell& tell, const std::function<bool()>& should_stop);
  /// Before a scene is asked for: what of the wishes can be told to be wrong by now (names, a plug-in that cannot be
  /// loaded), in words; else empty.
  [[nodiscard]] static std::string trouble_with(const DeviceWishes&);
  ~SessionDevices();

  /// What the haptic loop drives. Lives as long as this.
  [[nodiscard]] Device& felt() noexcept { return hand_ ? static_cast<Device&>(*hand_) : *guard_; }
  [[nodiscard]] bool is_simulated() const noexcept { return simulated_.has_value(); }
  /// What the person's scales come to with this device: the tool moves so many times as far as the handle.
  [[nodiscard]] const GearScales& scales() const noexcept { return scales_; }
  /// Where the device stands: the middle of what the scene's operator explores is in the middle of its workspace.
  [[nodiscard]] const spatial::Pose& X_WB() const noexcept { return X_WB_; }
  /// Every 50 ms or so, not from the haptic thread: says what changed and what to do, and starts again what died.
  void look(const Tell& tell);
  /// The device's name and how it is now, with what to do. The same thread.
  [[nodiscard]] std::string in_words() const;
  /// What the scene asks of the simulated hand that it and its device cannot give, in words; else empty. The tool gives
  /// way by its own surface, too.
  [[nodiscard]] std::string beyond_the_hand(const DeviceWishes&, const contact::Material& tool) const;
  /// It could give force, and waits for a hand to ask for it: how that does. Else empty.
  [[nodiscard]] std::string waits_for() const;
  /// How far the person has turned the view, and with it the device's axes, about z.
  [[nodiscard]] double view_yaw_rad() const noexcept { return hand_ ? hand_->view_yaw_rad() : 0; }
  /// Before the end: force goes to zero within GuardedDevice::kStop_s.
  void stop() noexcept { guard_->stop(); }

 private:
  /// A device and the process that owns it.
  struct Part {
    devices::OwnerProcess owner;
    devices::DeviceFile file;
    std::string serial;
    std::unique_ptr<devices::LinkedDevice> linked;
    std::string told;
  };

  SessionDevices() = default;
  [[nodiscard]] static tl::expected<std::unique_ptr<Part>, std::string> open_part(
      const devices::FoundDevice&, const DeviceWishes&, const Tell&, const std::function<bool()>& should_stop);
  [[nodiscard]] static std::unique_ptr<SessionDevices> simulate(const DeviceWishes&, const devices::DeviceModel&,
                                                                const Tell&);
  void guard(Device&, const DeviceWishes&, const devices::DeviceFile&, bool is_new, const Tell&);
  void tell_stage(const Tell&);
  void remember_once_trusted(const Tell&);
  [[nodiscard]] std::string how_to_enable() const;
  [[nodiscard]] std::string stage_in_words(devices::Stage) const;

  GearScales scales_;
  spatial::Pose X_WB_;
  devices::DeviceModel model_;                // of the primary
  std::vector<std::unique_ptr<Part>> parts_;  // the primary first
  std::optional<SimulatedDevice> simulated_;
  std::unique_ptr<devices::SourceDevice> source_;
  std::unique_ptr<devices::GuardedDevice> guard_;
  std::unique_ptr<devices::Hand> hand_;
  std::unique_ptr<StationKey> key_;
  devices::Stage told_stage_ = devices::Stage::kAbsent;
  bool is_remembered_ = false, is_masked_torque_told_ = false;
};

}  // namespace farfeel::master_station
