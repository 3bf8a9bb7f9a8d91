// Rung 3: contacts between the cached surfaces themselves, at the pose of every tick and whatever the delay.
//
// They are found by the code that the remote node runs. Where a contact's heights have not arrived those of the outline
// stand in for them, and the remote's newest contact of that place is felt, linearised and clamped, while it lies
// within what the outline's heights may be off: felt_once.h. Rungs that feel the remote's contacts use the same, so
// that no surface is first felt when they come.
#pragma once

#include <array>
#include <cstdint>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact_service/contact_service.h"
#include "haptic_core/local_model/received_contact.h"
#include "haptic_core/local_model/tile_cache.h"

namespace farfeel::local_model {

struct TickContacts {
  contact::ContactSet set;  ///< at this tick's pose
  std::array<Source, contact::kMaxContacts> source{};
  std::array<double, contact::kMaxContacts> off_m{};  ///< of each that is found, how far from the true depth at most
  std::uint32_t from_tiles = 0, from_remote = 0;      ///< of them; how many
  double remote_age_s = 0;                            ///< of the pose that the remote's answer, when they came
  std::uint32_t lacking = 0;  ///< contacts whose heights are not all here: felt by the outline, or as the remote tells
  const contact::ContactSet* told = nullptr;  ///< of beside_remote(): the remote's newest; null before any
  bool is_told_new = false;                   ///< since the tick before
};

/// Which remote contact stands in for each of ours that lacks heights; kNobody where none does. A remote contact is one
/// of ours already, the nearest that looks the same way, and stands in for no other: nothing is felt twice. One that is
/// near none of ours stands in for any that looks the same way.
inline constexpr std::uint32_t kNobody = 0xFFFF'FFFF;
using StandIns = std::array<std::uint32_t, contact::kMaxContacts>;
[[nodiscard]] StandIns stand_ins(const contact::ContactSet& ours, const std::array<bool, contact::kMaxContacts>& lacks,
                                 const contact::ContactSet& remote) noexcept;

/// Takes the contacts of objects that are not there, by now, out of a set that the remote has told.
void drop_absent(contact::ContactSet& told, const motion::MovingObjects& now) noexcept;

class LocalContacts {
 public:
  /// The cache must outlive it. Memory is taken here and nowhere else.
  explicit LocalContacts(TileCache& cache);

  /// The remote has answered: is_usable(set).
  void hear(const contact::ContactSet& set) noexcept;
  /// A course of an object that may change.
  void set_out(const motion::ObjectCourse& told) noexcept { service_.set_out(told); }
  /// Contacts at a tool pose; takes over tiles that have arrived. Every tick. Realtime-safe. Valid until the next call.
  [[nodiscard]] const TickContacts& at(const contact_service::ToolPose&) noexcept;
  /// The same where tool and objects will be some time ahead of this pose, if the tool goes on as it does.
  [[nodiscard]] const TickContacts& ahead_of(const contact_service::ToolPose&, double ahead_s) noexcept;
  /// All that is found at a tool pose, for rungs that feel the remote's contacts: LocalModel::refresh() says which are
  /// felt. Their ids are none of the remote's.
  [[nodiscard]] const TickContacts& beside_remote(const contact_service::ToolPose&) noexcept;
  [[nodiscard]] const TickContacts& beside_remote_ahead_of(const contact_service::ToolPose&, double ahead_s) noexcept;
  [[nodiscard]] const contact_service::StageTimes& last_times() const noexcept { return times_; }

 private:
  const contact_service::Answer& find(const contact_service::ToolPose&) noexcept;
  void feel(const contact::Contact&, Source, double off_m) noexcept;

  TileCache& cache_;
  contact_service::ContactService service_;
  contact_service::StageTimes times_;  // of the last answer
  contact::ContactSet remote_;
  bool is_remote_new_ = false, has_remote_ = false;
  TickContacts tick_;
};

}  // namespace farfeel::local_model
