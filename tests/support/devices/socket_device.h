// A device at the other end of a local socket, so that a test is its hardware: what it takes is seen, byte for byte,
// also from owners and keepers that are killed.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::test_support {

/// The driver's side. Found where the file of DriverOptions.firmware is a socket that listens.
extern const devices::DriverFamily kSocketDeviceFamily;
/// Of "socket-device"; nullptr: there is no such model.
[[nodiscard]] const devices::DeviceModel* socket_device_model(std::string_view name);

/// The hardware's side. One thread.
class SocketDevice {
 public:
  /// Listens at the path.
  explicit SocketDevice(std::string path);
  ~SocketDevice();
  SocketDevice(const SocketDevice&) = delete;
  SocketDevice& operator=(const SocketDevice&) = delete;

  /// Waits for a driver to come. False: none within the time.
  bool accept(int timeout_ms);
  /// Tells where the handle is.
  void tell(double x_m, std::uint32_t buttons);
  struct Taken {
    double force_N;
    std::int64_t time_ns;  ///< CLOCK_MONOTONIC
  };
  /// The next command; nothing when none came in the time, or the driver and its keeper are gone.
  std::optional<Taken> take(int timeout_ms);
  /// Pulls the plug.
  void unplug();
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
  int listening_ = -1, connected_ = -1;
};

}  // namespace farfeel::test_support
