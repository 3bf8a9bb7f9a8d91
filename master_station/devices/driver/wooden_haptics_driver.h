// WoodenHaptics, an open-hardware arm: its position, and force on its handle.
//
// Packets go one for one: a packet is sent only once the one before was answered, or is taken for lost. The encoders
// count from wherever the arm lay, so a person puts it into its neutral pose first. Whatever is odd on the way, the
// next packet asks for no current; the device itself turns its motors off after half a second without one.
#pragma once

#include <array>
#include <memory>

#include "codecs/device/wooden_haptics.h"
#include "haptic_core/realtime/periodic_loop.h"
#include "master_station/devices/channel/channel.h"
#include "master_station/devices/driver/driver.h"
#include "master_station/devices/driver/velocity_estimate.h"

namespace farfeel::devices {

class WoodenHapticsDriver final : public Driver {
 public:
  using Clock = std::int64_t (*)() noexcept;  ///< CLOCK_MONOTONIC [ns], but in tests

  WoodenHapticsDriver(std::unique_ptr<HidChannel>, FoundDevice, const codecs::WoodenHapticsArm& = {},
                      Clock = realtime::monotonic_now_ns);
  ~WoodenHapticsDriver() override;

  [[nodiscard]] const FoundDevice& identity() const noexcept override { return identity_; }
  /// kOpening until it answers; kHoming until it was moved and then held still in its neutral pose for 2 s, or held
  /// there while the button of its board was pressed; kReady. kFault: it fell silent, which ends when it answers again
  /// from a place it can have moved to, or lost count of where it is, which ends with a new plugging in.
  Stage step(std::int64_t deadline_ns, const Command&, Sample& newest) override;
  [[nodiscard]] std::string advice() const override;
  [[nodiscard]] std::optional<ZeroForce> zero_force() const override;

 private:
  enum class Phase : std::uint8_t { kOpening, kHoming, kSettingCounts, kReady, kSilent, kLost, kGone };

  /// One exchange, or the part of it that fits before the deadline. Nothing: no answer yet.
  std::optional<codecs::WoodenHapticsAnswer> exchange(const codecs::WoodenHapticsPacket&, std::int64_t deadline_ns);
  std::optional<codecs::WoodenHapticsAnswer> read_newest(std::int64_t deadline_ns);
  [[nodiscard]] codecs::WoodenHapticsPacket packet_for(const Command&) const;
  void take(const codecs::WoodenHapticsAnswer&);
  void start_homing();
  void home(const codecs::WoodenHapticsAnswer&);
  void check_counts_were_set(const codecs::WoodenHapticsAnswer&);
  void follow(const codecs::WoodenHapticsAnswer&);
  [[nodiscard]] bool is_plausible(const std::array<std::int16_t, 6>& counts) const;
  void remember(const std::array<std::int16_t, 6>& counts);

  std::unique_ptr<HidChannel> channel_;
  FoundDevice identity_;
  codecs::WoodenHapticsArm arm_;
  Clock now_ns_;
  Phase phase_ = Phase::kOpening;
  std::int64_t opened_ns_;

  bool is_asked_ = false;  // a packet is out and not answered
  std::int64_t asked_ns_ = 0, answered_ns_ = 0;
  std::uint64_t answers_ = 0;

  std::array<std::int16_t, 6> homing_from_{}, still_at_{};
  std::int64_t still_since_ns_ = 0;
  bool has_moved_ = false, is_button_pressed_ = false;
  std::int64_t asked_to_home_ns_ = 0;  // when it was homed, or last told that its button is pressed
  bool is_pressed_at_home_ = false;    // the board says so until its counts are set
  int set_tries_ = 0;

  VelocityEstimate velocity_;
  std::array<std::int16_t, 6> counts_{};  // the last that were plausible
  std::int64_t counts_ns_ = 0;
  int implausible_ = 0;  // in a row
};

extern const DriverFamily kWoodenHapticsFamily;

}  // namespace farfeel::devices
