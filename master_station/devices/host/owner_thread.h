// A device's owner on a thread of this process, with a keeper, for the commands that a person runs without a station:
// they open hardware as a session does.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <tl/expected.hpp>

#include "master_station/devices/host/owner.h"

namespace farfeel::devices {

class OwnerThread {
 public:
  [[nodiscard]] static tl::expected<std::unique_ptr<OwnerThread>, std::string> start(
      std::span<const DriverFamily> families, WantedDevice wanted, DriverOptions options);
  /// Force is off and the device is closed when this returns.
  ~OwnerThread();
  OwnerThread(const OwnerThread&) = delete;
  OwnerThread& operator=(const OwnerThread&) = delete;

  [[nodiscard]] LinkMemory& memory() noexcept { return link_.memory(); }
  /// The newest of each; empty ones before there are any.
  [[nodiscard]] Sample sample() const noexcept;
  [[nodiscard]] OpenedDevice opened() const noexcept;
  [[nodiscard]] std::string advice() const;

 private:
  OwnerThread(MappedLink link, std::span<const DriverFamily> families, WantedDevice wanted, DriverOptions options);

  MappedLink link_;
  Owner owner_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace farfeel::devices
