#include "haptic_core/contact/tracking/contact_tracker.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "haptic_core/contact/tracking/constants.h"
#include "haptic_core/contact/tracking/deepest.h"
#include "haptic_core/realtime/stopwatch.h"

namespace farfeel::contact {

using spatial::Pose;

TrackedObject::TrackedObject(const TouchableObject& object, const TouchableObject& tool,
                             const collision::HullTree& tool_tree)
    : X_WO(object.X_WO),
      is_there(object.is_there),
      material(combined(object.material, tool.material)),
      own_felt(object.prepared ? nullptr : std::make_unique<penetration::FeltSurface>(*object.felt)),
      felt(object.prepared ? object.prepared : own_felt.get()),
      is_textured(object.felt->is_textured() || tool.felt->is_textured()),
      tree(std::make_unique<collision::HullTree>(collision::ConvexPieces(*object.felt))),
      proximity(*tree, tool_tree),
      crossed(*object.felt, *tree, *tool.felt, tool_tree) {}

ContactTracker::ContactTracker(std::span<const TouchableObject> objects, const TouchableObject& tool,
                               double tolerance_m)
    : tolerance_m_(tolerance_m),
      own_tool_felt_(tool.prepared ? nullptr : std::make_unique<penetration::FeltSurface>(*tool.felt)),
      tool_felt_(tool.prepared ? tool.prepared : own_tool_felt_.get()),
      tool_tree_(std::make_unique<collision::HullTree>(collision::ConvexPieces(*tool.felt))) {
  objects_.reserve(objects.size());
  std::vector<motion::MovingObject> moving;
  for (const TouchableObject& object : objects) {
    const auto index = static_cast<std::uint32_t>(objects_.size());
    if (object.motion || object.may_change)
      moving.push_back({index, object.motion ? std::optional(*object.motion) : std::nullopt,
                        motion::at_rest(object.X_WO, object.is_there)});
    objects_.emplace_back(object, tool, *tool_tree_);
  }
  moving_ = motion::MovingObjects(std::move(moving));
}

void ContactTracker::go_to(double scene_s) noexcept {
  moving_.go_to(scene_s);
  for (const motion::Moved& moved : moving_.moved()) {
    objects_[moved.object].X_WO = moving_.X_WO(moved);
    objects_[moved.object].is_there = moved.is_there;
  }
}

void ContactTracker::find(const Pose& X_WT, double dt_s, StageTimes& times) noexcept {
  realtime::Stopwatch watch;
  count_ = 0;
  pairs_ = 0;
  times.proximity_us = times.clusters_us = 0;
  times.left_out = 0;
  const auto is_shallower = [](const Track& a, const Track& b) { return a.cluster.depth_m < b.cluster.depth_m; };
  for (std::uint32_t i = 0; i < objects_.size(); ++i) {
    TrackedObject& object = objects_[i];
    const Pose X_OT = spatial::inverse(object.X_WO) * X_WT;
    object.pairs = {};
    if (object.is_there)
      object.pairs = object.crossed.mended(object.proximity.nearer_than(tolerance_m_, X_OT), tolerance_m_, X_OT);
    pairs_ += static_cast<std::uint32_t>(object.pairs.size());
    times.proximity_us += watch.lap_us();
    for (const Cluster& cluster : object.clustering.update(object.pairs, tolerance_m_, dt_s)) {
      if (count_ == tracks_.size()) {
        ++times.left_out;
        const auto shallowest = std::min_element(tracks_.begin(), tracks_.end(), is_shallower);
        if (!(shallowest->cluster.depth_m < cluster.depth_m)) continue;
        std::move(shallowest + 1, tracks_.end(), shallowest);
        --count_;
      }
      tracks_[count_++] = {.id = 0, .object = i, .predecessor = 0, .cluster = cluster};
    }
    times.clusters_us += watch.lap_us();
  }
  names_.begin();
  for (std::size_t i = 0; i < count_; ++i) tracks_[i].id = names_.name(tracks_[i].object, tracks_[i].cluster.id);
  find_predecessors();
  times.clusters_us += watch.lap_us();
}

double ContactTracker::deepest_m(const Track& track) const noexcept {
  const CrossedSheets& sheets = object_of(track).crossed;
  double thinnest_m = std::numeric_limits<double>::infinity();
  for (const auto& [pieces, thickness_m] : {std::pair(&track.cluster.pieces_s, sheets.thickness_s_m()),
                                            std::pair(&track.cluster.pieces_t, sheets.thickness_t_m())}) {
    for (const std::uint32_t piece : pieces->view()) thinnest_m = std::min(thinnest_m, thickness_m[piece]);
  }
  return contact::deepest_m(thinnest_m);
}

/// Of those that are gone, the nearest of the same object and direction.
void ContactTracker::find_predecessors() noexcept {
  const std::span<Track> tracks{tracks_.data(), count_};
  const std::span<const Former> formers{former_.data(), former_count_};
  const auto is_here = [&](std::uint32_t id) {
    return std::any_of(tracks.begin(), tracks.end(), [id](const Track& track) { return track.id == id; });
  };
  for (Track& track : tracks) {
    if (std::any_of(formers.begin(), formers.end(), [&](const Former& former) { return former.id == track.id; }))
      continue;
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const Former& former : formers) {
      if (former.object != track.object || is_here(former.id) ||
          glm::dot(former.nhat_ST_S, track.cluster.nhat_ST_S) < kSameSideCosine)
        continue;
      const double apart_m = glm::distance(former.p_S, track.cluster.p_S);
      if (apart_m < nearest_m) nearest_m = apart_m, track.predecessor = former.id;
    }
  }
  former_count_ = count_;
  for (std::size_t i = 0; i < count_; ++i)
    former_[i] = {tracks[i].id, tracks[i].object, tracks[i].cluster.nhat_ST_S, tracks[i].cluster.p_S};
}

void ContactTracker::restart() noexcept {
  former_count_ = 0;
  names_.restart();
  for (TrackedObject& object : objects_) object.clustering.restart();
  moving_.restart();
}

}  // namespace farfeel::contact
