// What the lab does with one device: finds it, feels with it, pulls it out again and again, and looks at what the
// station asks of it then.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/hardware_lab/lab_device.h"

namespace farfeel::hardware_lab {

struct Row {
  std::string device;
  bool has_force = false;
  bool found = false;           ///< by the station, as an ordinary person's program
  bool contact_felt = false;    ///< the emulator's motors pushed the hand back, or the tool stopped at the surface
  std::vector<double> zero_ms;  ///< from the kernel's disconnect to zero command and no more ready, each unplugging
  std::vector<double> from_pull_ms;  ///< the same from the moment that the gadget began to go
  int replugged = 0;                 ///< how often it was ready again without a restart
  bool unprivileged = false;         ///< neither station nor owner has any privilege
  std::optional<bool> rule_applied;  ///< udev gave the node to the group
  std::optional<bool> lack_of_rule_told;
  std::optional<bool> stranger_told;  ///< ids that are nobody's were not taken, and that was told
  std::optional<bool> stall_told;
  std::optional<double> watchdog_ms;  ///< how long the device's own watchdog let the last force stand
  int watchdog_trips = 0;             ///< how often it took force off by itself
  std::vector<std::string> trouble;
};

struct DrillSettings {
  int unplugs = 20;
  bool is_bare = false;  ///< a station without haptics in the master's place
};

/// Tells progress, a sentence a line, on the way.
using Tell = std::function<void(const std::string&)>;

[[nodiscard]] Row drill(LabDevice& device, const DrillSettings& settings, const Tell& tell);

/// JSON of the host's last line.
[[nodiscard]] std::string json(const Row&);

}  // namespace farfeel::hardware_lab
