// Records a haptic loop's ticks: stands between the loop and its device, and is told what the remote sends.
#pragma once

#include "master_station/recording/tick_fields.h"

namespace farfeel::master_station {

/// Not for a real-time thread: it allocates.
class TickRecorder final : public Device {
 public:
  /// The device that the loop is to have is this, in place of that one, which must outlive it.
  explicit TickRecorder(Device& device, bool keeps_values = false);

  /// What the remote gave the loop within tick(), in its order.
  void note(TickMessage, std::span<const std::byte>);
  /// As HapticLoop::tick(), recorded.
  void tick(HapticLoop& loop, const realtime::TickTiming& timing, bool is_reset = false);
  [[nodiscard]] codecs::Stream& stream() { return stream_; }

  [[nodiscard]] const DeviceCapabilities& capabilities() const noexcept override { return device_.capabilities(); }
  [[nodiscard]] DeviceState read(std::int64_t time_ns) noexcept override;
  void write(const spatial::Wrench& F_hand_B) noexcept override { device_.write(F_hand_B); }
  [[nodiscard]] spatial::Wrench render(const spatial::Wrench& F_hand_B, const Circumstances&) noexcept override;
  void reset() noexcept override { device_.reset(); }
  [[nodiscard]] double masked_torque_Nm() const noexcept override { return device_.masked_torque_Nm(); }
  [[nodiscard]] double hand_energy_J() const noexcept override { return device_.hand_energy_J(); }

 private:
  Device& device_;
  bool keeps_values_;
  codecs::Stream stream_;
  TickInputs inputs_;
  std::vector<codecs::RecordedMessage> messages_;
};

}  // namespace farfeel::master_station
