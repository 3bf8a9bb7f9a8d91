// Where a session's contacts come from: the contact service, or a stand-in for it in tests.
#pragma once

#include "haptic_core/contact_service/contact_service.h"
#include "slave_sim/session/editable_surfaces.h"

namespace farfeel::slave_sim {

/// Used by the session's contact thread alone.
class ContactSource {
 public:
  virtual ~ContactSource() = default;
  /// Contacts at a pose; pose_sequence, pose_time_ns and X_WT of the result repeat the argument's. Valid until the next
  /// call.
  [[nodiscard]] virtual const contact_service::Answer& answer(const contact_service::ToolPose&) noexcept = 0;
  /// A surface has changed.
  virtual void edit(const SurfaceEdit&) noexcept {}
  /// An object has another course. Realtime-safe.
  virtual void set_out(const motion::ObjectCourse&) noexcept {}
  /// A new master begins: nothing of the last one's history may matter.
  virtual void restart() noexcept = 0;
};

}  // namespace farfeel::slave_sim
