// A HID device behind Linux's hidraw.
//
// hidapi finds devices, opens them and moves feature reports. Input and output reports go through a second descriptor
// of the same node, for three reasons: hidapi waits in whole milliseconds, and a 1 kHz exchange cannot; hidapi
// allocates a text for every failure, and a device that stalls fails often; and the keeper needs a descriptor, which
// hidapi hides.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "master_station/devices/channel/channel.h"

struct hid_device_;

namespace farfeel::devices {

/// One HID interface: a device may have several, and each says for itself what it is for.
struct FoundHid {
  std::uint16_t vendor = 0, product = 0, usage_page = 0, usage = 0;
  std::string serial;   ///< printable ASCII; empty: none told
  std::string path;     ///< /dev/hidraw3
  std::string trouble;  ///< empty: it can be opened; else why not and what to do
};

/// All that are plugged in, whether they can be opened or not. Opens each for a moment.
[[nodiscard]] std::vector<FoundHid> find_hid_devices();

/// From sysfs, which anybody may read; empty where it is not there.
[[nodiscard]] std::vector<std::byte> report_descriptor_of(const std::string& path);

class HidapiChannel final : public HidChannel {
 public:
  /// Has the device for itself among programs that ask so (flock). The error is for a person: what, why, what to do.
  [[nodiscard]] static tl::expected<std::unique_ptr<HidapiChannel>, std::string> open(const std::string& path);
  ~HidapiChannel() override;

  Transferred read(std::span<std::byte> report, std::int64_t deadline_ns) noexcept override;
  Transferred write(std::span<const std::byte> report) noexcept override;
  /// These two allocate where they fail: hidapi keeps a text.
  Transferred get_feature(std::span<std::byte> report) noexcept override;
  Transferred set_feature(std::span<const std::byte> report) noexcept override;
  [[nodiscard]] std::span<const std::byte> report_descriptor() const noexcept override { return report_descriptor_; }
  /// Open for reading and writing, not blocking. Whoever duplicates it shares the lock.
  [[nodiscard]] int descriptor() const noexcept override { return fd_; }

 private:
  HidapiChannel(hid_device_* features, int fd, std::vector<std::byte> report_descriptor);

  hid_device_* features_;
  int fd_;
  std::vector<std::byte> report_descriptor_;
  bool is_numbered_;  // whether a report of the node begins with an id
};

}  // namespace farfeel::devices
