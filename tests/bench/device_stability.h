// How stiff a coupling each model of device really renders calmly, by simulation, beside what the rule picks for it.
//
// The hardest hand is none: it damps nothing. So the handle is free but for the coupling to a point that stands still,
// without Coulomb friction, which hides the limit tenfold at rest, and with encoders that are fine, whose counts would
// look like unrest; it is kicked, and what decays is calm.
#pragma once

#include <string>
#include <vector>

#include "master_station/devices/model/coupling_rule.h"

namespace farfeel::bench {

/// Along an axis, or about it.
enum class Motion { kAlong, kAbout };

struct SpringOfDevice {
  double stiffness = 0, damping = 0;  ///< N/m and Ns/m, or Nm/rad and Nms/rad
};

/// Whether the kicked handle comes to rest, at a tick of 1 ms.
[[nodiscard]] bool is_calm(const devices::DeviceModel&, Motion, const SpringOfDevice&);
/// The same at the encoders' own resolution: it comes to rest within three of their counts.
[[nodiscard]] bool is_calm_as_counted(const devices::DeviceModel&, Motion, const SpringOfDevice&);
/// The stiffest calm spring of that damping, within a percent.
[[nodiscard]] double stiffest_calm(const devices::DeviceModel&, Motion, double damping);

struct DeviceRow {
  std::string device;
  Motion motion = Motion::kAlong;
  double delay_ms = 0;     ///< from a movement to its force, at the softer end of what is estimated
  SpringOfDevice picked;   ///< by `auto`
  double stiffest = 0;     ///< of the same damping, at the softer end
  bool is_calm = false;    ///< the pick, at the softer end and as estimated, by fine encoders and by the device's own
  bool is_stated = false;  ///< the data states the coupling: the rule was not asked
  [[nodiscard]] double share() const { return picked.stiffness / stiffest; }
  /// Calm, and where the rule picked, no softer than it need be.
  [[nodiscard]] bool is_good() const { return is_calm && (is_stated || share() >= kLeastShare); }
  static constexpr double kLeastShare = 0.75;
};

/// A row for each motion that the device can push.
[[nodiscard]] std::vector<DeviceRow> device_rows(const devices::DeviceModel&, devices::Grasp = devices::Grasp::kAny);

}  // namespace farfeel::bench
