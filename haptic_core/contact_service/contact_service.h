// World in, tool pose in, contacts out: everything the remote node computes about touch, without sockets or threads.
//
// One answer is: pairs of convex pieces that are near, contact patches of them, the textured penetration depth of each
// patch, and where one is asked for the wrench. Patches that are still apart are answered too: the operator's local
// model needs them before they touch.
#pragma once

#include <memory>
#include <span>

#include "haptic_core/contact/touchable.h"

namespace farfeel::contact_service {

using contact::Answer;
using contact::ContactOptions;
using contact::HeightPresence;
using contact::kHeldStiffness_N_per_m;
using contact::kToolSurface;
using contact::StageTimes;
using contact::SurfaceTile;
using contact::TilesNeeded;
using contact::ToolPose;
using contact::TouchableObject;

class ContactService {
 public:
  /// Prepares hull trees, surfaces and workspaces; the only place that allocates.
  ContactService(std::span<const TouchableObject> objects, const TouchableObject& tool, const ContactOptions&);
  ~ContactService();
  ContactService(ContactService&&) noexcept;
  ContactService& operator=(ContactService&&) noexcept;

  /// Contacts at a tool pose. The reference stays valid until the next call. One thread at a time.
  [[nodiscard]] const Answer& answer(const ToolPose&) noexcept;

  /// The tiles that contacts at a tool pose are made from, and those up to margin_m beside them. soft_width_m: of all
  /// contacts, where it is more than asked for. The history is the answers' own: whoever asks about other poses keeps a
  /// service for that and restarts it. Valid until the next call.
  [[nodiscard]] TilesNeeded tiles_needed(const ToolPose&, double margin_m, double soft_width_m = 0);

  /// A course of an object that may change: from the next call on. Realtime-safe.
  void set_out(const motion::ObjectCourse&) noexcept;

  /// Forgets all that was found, so that the next answer is a new service's: after another session has begun, or the
  /// tool was put somewhere else. Realtime-safe.
  void restart() noexcept;

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::contact_service
