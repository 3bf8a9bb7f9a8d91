// The other end of the haptic lane, as the loop sees it: poses go up, contacts come down, nothing waits.
#pragma once

#include <cstdint>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/teleoperation/controller.h"

namespace farfeel::master_station {

/// The tool's state at one tick.
struct ToolState {
  std::uint32_t sequence = 0;  ///< grows by one a tick, wraps
  std::int64_t time_ns = 0;    ///< scene time: since the loop's first tick
  spatial::Pose X_WT;
  spatial::Twist V_WT_W;               ///< of T's origin
  teleoperation::LineValue line = {};  ///< means something where it moves a tool that the remote simulates
};

/// Called by the haptic thread alone, from inside a tick: neither call may block, allocate, lock, throw or log.
class Remote {
 public:
  virtual ~Remote() = default;

  /// Every tick. What can't be sent now is dropped: the next tick's state replaces it.
  virtual void send(const ToolState&) noexcept = 0;

  /// Takes over the newest contacts; older ones that arrive late are dropped by the implementation or by the loop.
  /// Returns whether `newest` was written, which happens only with contacts newer than those of the call before.
  virtual bool poll(contact::ContactSet& newest) noexcept = 0;

  /// Takes over the next course of an object of the scene that was told, in their order. Returns whether there was one.
  virtual bool take_course(motion::ObjectCourse&) noexcept { return false; }

  /// What came over the line with the contacts that poll() gave last, where the remote simulates the tool.
  [[nodiscard]] virtual teleoperation::LineValue line() const noexcept { return {}; }
};

}  // namespace farfeel::master_station
