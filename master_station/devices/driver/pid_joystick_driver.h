// A joystick or wheel with force feedback (USB class PID, usage page 0x0F) through the kernel's input node.
//
// Pose: the stick's one or two axes as a position of D, x to the right, y away from the person, kTravel_m from the
// middle to each end; and the same as a deflection. One effect, a constant force, is uploaded once and then changed.
// Full level is a command of kFullForce_N: such devices do not know newtons, and until somebody measures one, the
// command's force is a share of the greatest (model/pid-joystick.toml says so).
//
// A change of the effect is a transfer on USB, mostly of 1 to 8 ms: it is made every kUpdate_ns at most. Zero is not
// limited: it stops the effect. The effect ends by itself kEffectLength_ms after it was last played, so that a device
// whose computer hangs lets go; it is played again long before.
//
// Directions are taken as linux/input.h words them: the effect pushes towards 0x0000 down (the person), 0x4000 left,
// 0x8000 up, 0xC000 right. Some drivers of the kernel mean where the force comes from: such a device pulls where it
// should push.
#pragma once

#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/channel/evdev_channel.h"
#include "master_station/devices/driver/driver.h"
#include "master_station/devices/driver/velocity_estimate.h"

namespace farfeel::devices {

extern const DriverFamily kPidJoystickFamily;

class PidJoystickDriver final : public Driver {
 public:
  static constexpr double kTravel_m = 0.04;  ///< of model/pid-joystick.toml's workspace
  static constexpr double kFullForce_N = 1;  ///< of its max_force_N
  static constexpr std::int64_t kUpdate_ns = 4'000'000;
  static constexpr std::uint16_t kEffectLength_ms = 100;

  /// Fails where the channel has no constant force, no axis, or an axis without a range.
  [[nodiscard]] static tl::expected<std::unique_ptr<Driver>, DeviceError> open(std::unique_ptr<EvdevChannel> channel,
                                                                               FoundDevice identity);
  ~PidJoystickDriver() override;

  [[nodiscard]] const FoundDevice& identity() const noexcept override { return identity_; }
  Stage step(std::int64_t deadline_ns, const Command& command, Sample& newest) override;
  [[nodiscard]] std::string advice() const override;
  [[nodiscard]] std::optional<ZeroForce> zero_force() const override;

 private:
  struct Axis {
    std::uint16_t code;
    int minimum, maximum, value;
    [[nodiscard]] double share() const noexcept;  ///< -1 to 1; 0 in the middle of the range
  };

  PidJoystickDriver(std::unique_ptr<EvdevChannel> channel, FoundDevice identity, std::vector<Axis> axes);
  bool set_up() noexcept;
  void read(std::int64_t deadline_ns) noexcept;
  void take(const input_event& event) noexcept;
  void push(const glm::dvec3& force_B_N, std::int64_t now_ns) noexcept;
  void stop() noexcept;
  void note(ChannelState state) noexcept;
  [[nodiscard]] spatial::Pose pose() const noexcept;

  std::unique_ptr<EvdevChannel> channel_;
  FoundDevice identity_;
  std::vector<Axis> axes_;  ///< x, and y where there is one
  ff_effect effect_{};
  std::int64_t tried_ns_ = 0, updated_ns_ = 0, played_ns_ = 0;
  bool is_set_up_ = false, is_playing_ = false, is_gone_ = false;
  bool is_force_to_wait_ = false;  ///< after a fault, for a command without force
  std::int64_t time_ns_ = 0, polled_ns_ = 0;
  std::uint64_t reports_ = 0;
  std::uint32_t buttons_ = 0;
  VelocityEstimate velocity_;
};

}  // namespace farfeel::devices
