// An input node of the kernel with force feedback (/dev/input/event7): what a driver needs of it. The real one is
// libevdev over the node; tests put an emulator here.
//
// One thread, the driver's. No call allocates once open.
#pragma once

#include <linux/input.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "master_station/devices/channel/channel.h"

namespace farfeel::devices {

class EvdevChannel {
 public:
  virtual ~EvdevChannel() = default;
  /// The oldest event that waits, or the next that comes before deadline_ns (CLOCK_MONOTONIC, as the event's time is).
  /// Where the kernel dropped some, what changed meanwhile comes as events.
  virtual ChannelState read(input_event& event, std::int64_t deadline_ns) noexcept = 0;
  /// EV_FF: plays or stops an effect, sets gain or autocenter. kStalled: the device refused.
  virtual ChannelState write(std::uint16_t type, std::uint16_t code, std::int32_t value) noexcept = 0;
  /// EVIOCSFF: a new effect (id -1; gets its id), or another force of one that is there. May take a USB transfer.
  virtual ChannelState upload(ff_effect& effect) noexcept = 0;
  [[nodiscard]] virtual bool has(std::uint16_t type, std::uint16_t code) const noexcept = 0;
  [[nodiscard]] virtual std::optional<input_absinfo> axis(std::uint16_t code) const noexcept = 0;
  [[nodiscard]] virtual int descriptor() const noexcept = 0;  ///< for the keeper; -1: none
};

struct FoundEvdev {
  std::string path, title, serial;  ///< serial: what the device tells, or where it is plugged in
  std::string trouble;              ///< empty: this user may read and write it
};

/// Nodes with a constant force and an axis, by what sysfs says; none is opened.
[[nodiscard]] std::vector<FoundEvdev> find_force_feedback(const std::string& sysfs = "/sys/class/input",
                                                          const std::string& nodes = "/dev/input");

[[nodiscard]] tl::expected<std::unique_ptr<EvdevChannel>, std::string> open_evdev(const std::string& path);

}  // namespace farfeel::devices
