// Owns one device: finds it, opens it, steps its driver once a millisecond, and lets no force last that nobody asked
// for within kStaleCommand_ns.
//
// It goes on through unplugging and plugging in. Each time that force was taken off by somebody else than the station
// (unplugged, keeper, a driver's fault) the sample's `opening` changes: the station then wants a new grip before any
// force.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/host/keeper.h"
#include "master_station/devices/link/link_memory.h"

namespace farfeel::devices {

/// Which device: a model or family by name, and a serial number.
struct WantedDevice {
  std::string name = "auto";  ///< any, in the families' order
  std::string serial;         ///< empty: any

  [[nodiscard]] bool matches(const FoundDevice& found, std::string_view family) const;
};

/// "auto", "falcon", "falcon:A1B2".
[[nodiscard]] WantedDevice parse_wanted(std::string_view text);

/// One thread uses it.
class Owner {
 public:
  /// All outlive the owner. link_fd: of `memory`, for keepers; -1: none is started (tests of the owner alone).
  Owner(LinkMemory& memory, int link_fd, std::span<const DriverFamily> families, WantedDevice wanted,
        DriverOptions options);
  ~Owner();

  /// What belongs to the period that ends at deadline_ns: looks for the device, or steps its driver.
  void step(std::int64_t now_ns, std::int64_t deadline_ns);
  /// Steps until `stop`, on the calling thread.
  void run(const std::atomic<bool>& stop);

  static constexpr std::int64_t kPeriod_ns = 1'000'000;
  static constexpr std::int64_t kLookAgain_ns = 250'000'000;  ///< for a device, while there is none

 private:
  void look_for_it(std::int64_t now_ns);
  void opened(std::unique_ptr<Driver> driver);
  void close();
  void begin_opening();
  void keep_force_off();
  [[nodiscard]] Command command_at(std::int64_t now_ns) const noexcept;
  void tell(Stage stage, std::string_view advice);

  LinkMemory& memory_;
  int link_fd_;
  std::span<const DriverFamily> families_;
  WantedDevice wanted_;
  DriverOptions options_;
  std::unique_ptr<Driver> driver_;
  std::optional<Keeper> keeper_;
  bool has_asked_for_keeper_ = false;
  std::uint32_t taken_off_ = 0;
  std::int64_t looked_ns_ = 0, opened_ns_ = 0;
  Sample sample_;
  std::string told_;
};

}  // namespace farfeel::devices
