// Which contact is which: decided here, once an answer, and nowhere else at the remote.
//
// Pairs of convex pieces that are near become a few patches, and a pair stays with its patch until another is clearly
// nearer (clustering.h). That ownership is a contact's identity: a track goes on as long as its patch owns pairs. A
// track is identity and place alone. What a later stage keeps of it is a column of that stage's own (per_track.h),
// which is empty when the track is new.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "haptic_core/collision/proximity_query.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/touchable.h"
#include "haptic_core/contact/tracking/clustering.h"
#include "haptic_core/contact/tracking/crossed_sheets.h"
#include "haptic_core/contact/tracking/track_names.h"
#include "haptic_core/motion/moving_objects.h"
#include "haptic_core/penetration/felt_surface.h"

namespace farfeel::contact {

/// One contact of an answer, before anything is known of its depth but the coarse pieces'.
struct Track {
  std::uint32_t id = 0;      ///< ContactId::number, a slot and a generation: see track_names.h
  std::uint32_t object = 0;  ///< index of S
  /// Of a track that is new: the one that went in its place, whose columns it may go on with; 0: none. The witness of a
  /// line or a face jumps from end to end, and its patch is then made anew.
  std::uint32_t predecessor = 0;
  Cluster cluster;  ///< its patch, in S
};

/// One scene object as contacts with it are looked for.
struct TrackedObject {
  TrackedObject(const TouchableObject& object, const TouchableObject& tool, const collision::HullTree& tool_tree);

  spatial::Pose X_WO;    ///< at the scene time at hand
  bool is_there = true;  ///< then
  Material material;     ///< of the object and the tool
  std::unique_ptr<penetration::FeltSurface> own_felt;
  const penetration::FeltSurface* felt;
  bool is_textured;                           ///< the object or the tool
  std::unique_ptr<collision::HullTree> tree;  ///< behind a pointer: the query keeps its address
  collision::ProximityQuery proximity;
  CrossedSheets crossed;
  std::span<const collision::ProximityPair> pairs;  ///< of the answer at hand
  Clustering clustering;
};

/// One thread at a time.
class ContactTracker {
 public:
  /// The only place that allocates.
  ContactTracker(std::span<const TouchableObject> objects, const TouchableObject& tool, double tolerance_m);

  /// Puts the objects that move to where they are at that scene time. Realtime-safe.
  void go_to(double scene_s) noexcept;
  /// Finds the tracks at a tool pose, dt_s after the last. Where there are more than kMaxContacts the shallowest are
  /// left out, and counted. Realtime-safe.
  void find(const spatial::Pose& X_WT, double dt_s, StageTimes& times) noexcept;
  void restart() noexcept;
  /// MovingObjects::set_out(). Realtime-safe.
  void set_out(const motion::ObjectCourse& told) noexcept { (void)moving_.set_out(told); }

  /// As found last: by object, then by falling weight.
  [[nodiscard]] std::span<const Track> tracks() const noexcept { return {tracks_.data(), count_}; }
  [[nodiscard]] const TrackedObject& object_of(const Track& track) const { return objects_[track.object]; }
  [[nodiscard]] std::span<const TrackedObject> objects() const { return objects_; }
  /// How deep this contact may be looked up [m]: by the thinnest of its pieces, see deepest.h.
  [[nodiscard]] double deepest_m(const Track&) const noexcept;
  [[nodiscard]] const penetration::FeltSurface& tool_felt() const { return *tool_felt_; }
  [[nodiscard]] std::uint32_t pairs() const { return pairs_; }
  [[nodiscard]] const motion::MovingObjects& moving() const { return moving_; }

 private:
  double tolerance_m_;
  std::unique_ptr<penetration::FeltSurface> own_tool_felt_;
  const penetration::FeltSurface* tool_felt_;
  std::unique_ptr<collision::HullTree> tool_tree_;
  std::vector<TrackedObject> objects_;
  motion::MovingObjects moving_;
  void find_predecessors() noexcept;

  std::array<Track, kMaxContacts> tracks_{};
  std::size_t count_ = 0;
  /// A track of the answer before.
  struct Former {
    std::uint32_t id = 0, object = 0;
    glm::dvec3 nhat_ST_S{0}, p_S{0};
  };
  std::array<Former, kMaxContacts> former_{};
  std::size_t former_count_ = 0;
  TrackNames names_;
  std::uint32_t pairs_ = 0;
};

}  // namespace farfeel::contact
