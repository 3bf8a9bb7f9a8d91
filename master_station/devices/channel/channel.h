// Bytes to and from a device: what a driver needs of a channel. The real ones are libusb and hidapi; tests put an
// emulator here.
//
// One thread, the driver's. No call allocates once open, but where said.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace farfeel::devices {

/// How a call on a channel ended. n > 0: so many bytes.
enum class ChannelState : std::uint8_t {
  kDone,
  kNothing,  ///< nothing came until the deadline
  kStalled,  ///< the endpoint refused; may be tried again
  kGone      ///< unplugged, or the daemon hung up: for good
};

struct Transferred {
  ChannelState state = ChannelState::kNothing;
  std::size_t bytes = 0;
};

/// Reports of a HID device. The first byte is the report's id, 0 where the device numbers none, in both directions.
class HidChannel {
 public:
  virtual ~HidChannel() = default;
  /// The oldest report that waits, or the next that comes before deadline_ns (CLOCK_MONOTONIC).
  virtual Transferred read(std::span<std::byte> report, std::int64_t deadline_ns) noexcept = 0;
  virtual Transferred write(std::span<const std::byte> report) noexcept = 0;
  virtual Transferred get_feature(std::span<std::byte> report) noexcept = 0;  ///< report[0] says which
  virtual Transferred set_feature(std::span<const std::byte> report) noexcept = 0;
  [[nodiscard]] virtual std::span<const std::byte> report_descriptor() const noexcept = 0;
  [[nodiscard]] virtual int descriptor() const noexcept = 0;  ///< file descriptor for the keeper; -1: none
};

/// A USB device with one bulk endpoint each way.
class UsbChannel {
 public:
  virtual ~UsbChannel() = default;
  /// A vendor's control request without data, during set-up; waits up to 1 s.
  virtual Transferred control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                              std::uint16_t index) noexcept = 0;
  /// With data in.
  virtual Transferred control_in(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
                                 std::uint16_t index, std::span<std::byte> data) noexcept = 0;
  /// Starts sending; kNothing: the one before is still under way, and this one was not taken.
  virtual Transferred send(std::span<const std::byte> bytes) noexcept = 0;
  /// The oldest IN transfer that was not told yet, one alone and whole where it fits: serial chips tell packets by
  /// their place in a transfer. Waits for one until deadline_ns (CLOCK_MONOTONIC). Reads are always under way, so that
  /// none is missed; 512 bytes hold any.
  virtual Transferred receive(std::span<std::byte> bytes, std::int64_t deadline_ns) noexcept = 0;
  [[nodiscard]] virtual int descriptor() const noexcept = 0;  ///< usbfs, for the keeper; -1: none
  [[nodiscard]] virtual std::uint8_t out_endpoint() const noexcept = 0;
};

}  // namespace farfeel::devices
