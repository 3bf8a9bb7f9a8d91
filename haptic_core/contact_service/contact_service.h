// World in, tool pose in, contacts out: everything the remote node computes about touch, without sockets or threads.
//
// One answer is: proximity of every object's convex pieces to the tool's, clusters of near pairs, the textured
// penetration depth of each cluster, the penalty wrench and friction. Clusters that are still apart are answered too:
// the operator's local model needs them before they touch.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/doubts.h"
#include "haptic_core/contact/touchable.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact_service {

using contact::ContactOptions;
using contact::HeightPresence;
using contact::kHeldStiffness_N_per_m;
using contact::kToolSurface;
using contact::StageTimes;
using contact::SurfaceTile;
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
  [[nodiscard]] const contact::ContactSet& answer(const ToolPose&) noexcept;

  /// Of a contact of the last answer, some of whose heights are not at hand and are stood in for: how far its depth is
  /// from the true one, at most [m]. None: all are at hand.
  [[nodiscard]] std::optional<double> outline_off_m(std::uint32_t contact_id) const noexcept;

  /// The tiles that contacts at a tool pose are made from, nearest contact first, and those up to margin_m beside them;
  /// some twice. soft_width_m: of all contacts, where it is more than asked for. The history is the answers' own:
  /// whoever asks about other poses keeps a service for that and restarts it. Valid until the next call.
  [[nodiscard]] std::span<const SurfaceTile> tiles_needed(const ToolPose&, double margin_m, double soft_width_m = 0);

  /// How many contacts there were, near ones too, at the last pose that was asked about.
  [[nodiscard]] std::uint32_t contacts_near() const noexcept;

  /// The fastest that the tool's surface and an object's move past each other where they are near. tool: the last pose
  /// that was asked about.
  [[nodiscard]] double fastest_near_m_s(const ToolPose& tool) const noexcept;

  /// The objects that move, where they were at the last pose that was asked about.
  [[nodiscard]] const motion::MovingObjects& moving() const noexcept;

  /// A course of an object that may change. Realtime-safe.
  void set_out(const motion::ObjectCourse&) noexcept;

  /// Forgets the contacts' history: ids start anew, as after the tool has been put somewhere else.
  void restart() noexcept;

  /// That pose, at the place where the contacts of the last answer were looked up (proxy.h): tiles are needed there.
  [[nodiscard]] ToolPose at_proxy(ToolPose tool) const noexcept;
  [[nodiscard]] const StageTimes& last_times() const noexcept;
  /// Of all answers so far.
  [[nodiscard]] const contact::DoubtCounts& doubts() const noexcept;

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace farfeel::contact_service
