// The emulated Falcon behind a UsbChannel, in memory and in a time of its own: seconds of the device take milliseconds.
#pragma once

#include <algorithm>

#include "master_station/devices/channel/channel.h"
#include "tests/support/devices/falcon_emulator.h"

namespace farfeel::test_support {

/// The emulator and the clock outlive the channel, so that a test sees what its end left behind.
class FalconInMemory final : public devices::UsbChannel {
 public:
  FalconInMemory(FalconEmulator& emulator, std::int64_t& now_ns) : emulator_(emulator), now_ns_(now_ns) {}

  devices::Transferred control(std::uint8_t type, std::uint8_t request, std::uint16_t value,
                               std::uint16_t index) noexcept override {
    now_ns_ += kFrame_ns;
    if (emulator_.is_unplugged()) return {devices::ChannelState::kGone, 0};
    const bool taken = emulator_.control(now_ns_, type, request, value, index);
    return {taken ? devices::ChannelState::kDone : devices::ChannelState::kStalled, 0};
  }
  devices::Transferred control_in(std::uint8_t, std::uint8_t, std::uint16_t, std::uint16_t,
                                  std::span<std::byte>) noexcept override {
    return {devices::ChannelState::kStalled, 0};
  }
  devices::Transferred send(std::span<const std::byte> bytes) noexcept override {
    now_ns_ += kSend_ns;
    if (emulator_.is_unplugged()) return {devices::ChannelState::kGone, 0};
    const bool taken = emulator_.bulk_out(now_ns_, bytes);
    return {taken ? devices::ChannelState::kDone : devices::ChannelState::kStalled, taken ? bytes.size() : 0};
  }
  devices::Transferred receive(std::span<std::byte> bytes, std::int64_t deadline_ns) noexcept override {
    if (emulator_.is_unplugged()) return {devices::ChannelState::kGone, 0};
    const std::int64_t next_ns = emulator_.next_in_ns();
    if (next_ns > deadline_ns) {
      now_ns_ = std::max(now_ns_, deadline_ns);
      emulator_.advance(now_ns_);
      return {};
    }
    now_ns_ = std::max(now_ns_, next_ns);
    const auto in = emulator_.bulk_in(now_ns_, bytes);
    if (!in) return {};
    return {in->is_stalled ? devices::ChannelState::kStalled : devices::ChannelState::kDone, in->bytes};
  }
  [[nodiscard]] int descriptor() const noexcept override { return -1; }
  [[nodiscard]] std::uint8_t out_endpoint() const noexcept override { return FalconEmulator::kOut; }

 private:
  static constexpr std::int64_t kFrame_ns = 1'000'000, kSend_ns = 50'000;
  FalconEmulator& emulator_;
  std::int64_t& now_ns_;
};

}  // namespace farfeel::test_support
