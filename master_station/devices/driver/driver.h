// One kind of hardware behind a channel: what its owner steps.
//
// A driver is found, opened, and stepped on one thread, its owner's. It ends by being destroyed, which leaves the
// device without force where the device can still be reached.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "master_station/devices/link/sample.h"

namespace farfeel::devices {

struct DeviceError {
  std::string message;  ///< what was tried, what was wrong, what to do
};

/// A device that is plugged in, opened or not.
struct FoundDevice {
  std::string model;    ///< of the data in model/: "falcon", "spacemouse-compact"
  std::string serial;   ///< empty: it tells none; then the port it is plugged into stands for it
  std::string path;     ///< /dev/hidraw3, bus 1 device 7, ws://localhost:10001, a library's path
  std::string trouble;  ///< empty: it can be opened; else why not and what to do ("no permission: ...")
};

/// How force is taken off a device by whoever holds its descriptor, with one system call and no state: for the keeper,
/// when the owner is gone.
struct ZeroForce {
  enum class How : std::uint8_t {
    kWrite,    ///< write(fd, bytes): hidraw, evdev, a socket
    kUsbBulk,  ///< USBDEVFS_BULK out on a usbfs descriptor
  };
  int fd = -1;
  How how = How::kWrite;
  std::uint8_t endpoint = 0;  ///< of kUsbBulk
  std::size_t size = 0;
  std::array<std::byte, 128> bytes{};
};

class Driver {
 public:
  virtual ~Driver() = default;
  Driver() = default;
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;

  [[nodiscard]] virtual const FoundDevice& identity() const noexcept = 0;
  /// One step: takes over what the device sent, gives it the command, goes on with set-up, firmware and homing. May
  /// wait for the device, until deadline_ns (CLOCK_MONOTONIC) at most. Fills all of `newest` but `opening`.
  /// A command is obeyed only in kReady; the owner has checked its age. kAbsent: the device is gone for good, and the
  /// driver is to be destroyed. No allocation once ready.
  virtual Stage step(std::int64_t deadline_ns, const Command& command, Sample& newest) = 0;
  /// One sentence for a person: what the stage waits for, what was wrong, what to do. Empty in kReady.
  [[nodiscard]] virtual std::string advice() const = 0;
  /// What the device itself says of its figures, as a file of model/ has them, over what model/ says of
  /// identity().model; empty: nothing. The same from opening on.
  [[nodiscard]] virtual std::string model_toml() const { return {}; }
  /// Nothing: force cannot be taken off from outside, or there is none.
  [[nodiscard]] virtual std::optional<ZeroForce> zero_force() const { return std::nullopt; }
};

struct DriverOptions {
  std::string firmware;  ///< file; empty: none, or the driver's own search
  std::string plug_in;   ///< shared library
};

/// All devices that one driver knows.
struct DriverFamily {
  std::string_view name;  ///< "falcon"
  std::vector<FoundDevice> (*find)(const DriverOptions&);
  tl::expected<std::unique_ptr<Driver>, DeviceError> (*open)(const FoundDevice&, const DriverOptions&);
};

/// Every family that this program was built with.
[[nodiscard]] std::span<const DriverFamily> driver_families();

}  // namespace farfeel::devices
