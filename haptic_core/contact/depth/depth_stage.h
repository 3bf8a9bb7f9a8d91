// The middle stage of an answer: how deep each track is. A penetration back end searches, or a closed form says it, or
// the last search is extrapolated; where the surfaces are no height fields the coarse pieces and points of the surface
// have their say.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/contact/depth/depth_scheduler.h"
#include "haptic_core/contact/depth/plane_depth.h"
#include "haptic_core/contact/depth/points/point_fallback.h"
#include "haptic_core/contact/depth/soft_widths.h"
#include "haptic_core/contact/touchable.h"
#include "haptic_core/contact/tracking/contact_tracker.h"
#include "haptic_core/penetration/back_end.h"
#include "haptic_core/penetration/window.h"

namespace farfeel::contact {

/// What is known of a track's depth before the sources are blended.
struct FieldDepth {
  double soft_width_m = 0;
  std::span<const std::uint32_t> triangles_s, triangles_t;  ///< of its pieces
  penetration::Penetration depth;                           ///< unknown where the patches share nothing
  bool lacks_heights = false;                               ///< not all are at hand: the outline's stand in
  double outline_off_m = 0;                                 ///< and the depth is off by no more than this [m]
  PointShare layers;  ///< how much it is no height field because pieces lie above each other
};

/// Shares of what is felt of a contact that are no height field's.
struct OtherShares {
  double coarse = 0, points = 0;
};

/// One thread at a time.
class DepthStage {
 public:
  /// The only place that allocates; the tracker outlives this.
  DepthStage(const ContactTracker&, const penetration::Limits& limits, const ContactOptions& options);

  /// Depths of all tracks, looked up at that tool pose, dt_s after the last. Realtime-safe.
  void find(const spatial::Pose& X_WT, double dt_s, bool wants_curvature, StageTimes& times) noexcept;
  /// Of the track number i.
  [[nodiscard]] const FieldDepth& field(std::size_t i) const noexcept { return fields_[i]; }
  /// The contact that track number i is, at the same pose: its sources blended. Where the height fields are not to be
  /// believed the coarse pieces' depth is the least that is felt, and points of the surfaces are felt in their place.
  /// is_drawn_on: the tool is deeper than that pose, and what is apart there may push.
  OtherShares blend(Contact&, std::size_t i, const spatial::Pose& X_WT, bool is_drawn_on, StageTimes& times) noexcept;
  void restart() noexcept {
    scheduler_.restart();
    widths_.restart();
    back_end_->restart();
    for (const Points& points : points_) points.fallback->restart();
  }

  /// Whether any of an object's or the tool's heights may not be at hand.
  [[nodiscard]] bool may_lack_heights(std::uint32_t object) const noexcept;

  /// The tiles that the tracks are made from, and those up to margin_m beside them, the deepest track's first.
  [[nodiscard]] std::span<const SurfaceTile> tiles_needed(const spatial::Pose& X_WT, double margin_m,
                                                          double soft_width_m);

 private:
  /// What is felt as points of one object.
  struct Points {
    std::unique_ptr<LayeredSurface> layers;  ///< behind a pointer: the fallback keeps its address
    std::unique_ptr<PointFallback> fallback;
  };

  /// Of the whole plane.
  [[nodiscard]] penetration::Query make_query(std::size_t i, const spatial::Pose& X_WT) noexcept;
  /// Projects the patches. False where they share nothing.
  [[nodiscard]] bool fit_window(penetration::Query&) noexcept;
  /// Makes ready for the back end what may be searched, and notes which of its heights lack: false where there is
  /// nothing.
  [[nodiscard]] bool may_be_searched(std::size_t i, penetration::Query&) noexcept;
  /// Of the patches that fit_window() has projected last.
  void note_lack(std::size_t i, const penetration::Query&) noexcept;
  void note_lack_of_layers(std::size_t i) noexcept;
  [[nodiscard]] bool wants_window(std::uint32_t object) const noexcept;
  /// Whether contacts with this object need no grid.
  [[nodiscard]] bool is_plain(const TrackedObject& object) const noexcept;
  /// Searches those whose turn it is, and extrapolates the others.
  void search(const spatial::Pose& X_WT, StageTimes& times) noexcept;
  void judge(std::size_t i, const spatial::Pose& X_WT, StageTimes& times) noexcept;

  const ContactTracker& tracker_;
  ContactOptions options_;
  penetration::WindowFinder windows_;
  PlaneDepth plane_depth_;
  std::unique_ptr<LayeredSurface> tool_layers_;
  std::vector<Points> points_;  // of each object
  std::unique_ptr<penetration::BackEnd> back_end_;
  penetration::Traits traits_;
  DepthScheduler scheduler_;
  SoftWidths widths_;

  std::array<std::vector<std::uint32_t>, kMaxContacts> triangles_s_, triangles_t_;
  std::array<FieldDepth, kMaxContacts> fields_{};
  std::size_t asked_ = 0;  // queries of this answer
  std::array<penetration::Query, kMaxContacts> queries_{};
  std::array<penetration::Penetration, kMaxContacts> answers_{};
  std::array<std::size_t, kMaxContacts> asked_by_{};  // number of each query's track
  std::vector<SurfaceTile> needed_;
};

}  // namespace farfeel::contact
