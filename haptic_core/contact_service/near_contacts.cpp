#include "haptic_core/contact_service/near_contacts.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "haptic_core/contact/deepest.h"
#include "haptic_core/contact_service/stopwatch.h"

namespace farfeel::contact_service {

using contact::Cluster;
using spatial::Pose;

namespace {

/// Pieces of one cluster lie within about four tolerances of each other.
constexpr double kLayersReach = 4;

}  // namespace

FeltObject::FeltObject(const TouchableObject& object, const TouchableObject& tool, const collision::HullTree& tool_tree,
                       contact::LayeredSurface& tool_layers, double tolerance_m, bool has_points)
    : X_WO(object.X_WO),
      material(contact::combined(object.material, tool.material)),
      own_felt(object.prepared ? nullptr : std::make_unique<penetration::FeltSurface>(*object.felt)),
      felt(object.prepared ? object.prepared : own_felt.get()),
      is_textured(object.felt->is_textured() || tool.felt->is_textured()),
      tree(std::make_unique<collision::HullTree>(collision::ConvexPieces(*object.felt))),
      proximity(*tree, tool_tree),
      crossed(*object.felt, *tree, *tool.felt, tool_tree),
      layers(std::make_unique<contact::LayeredSurface>(*felt, kLayersReach * tolerance_m)),
      as_points(std::make_unique<contact::PointFallback>(*layers, tool_layers, tolerance_m, has_points)) {}

NearContacts::NearContacts(std::span<const TouchableObject> objects, const TouchableObject& tool, double tolerance_m,
                           bool has_points)
    : tolerance_m_(tolerance_m),
      own_tool_felt_(tool.prepared ? nullptr : std::make_unique<penetration::FeltSurface>(*tool.felt)),
      tool_felt_(tool.prepared ? tool.prepared : own_tool_felt_.get()),
      tool_tree_(std::make_unique<collision::HullTree>(collision::ConvexPieces(*tool.felt))),
      tool_layers_(std::make_unique<contact::LayeredSurface>(*tool_felt_, kLayersReach * tolerance_m)) {
  objects_.reserve(objects.size());
  std::vector<motion::MovingObject> moving;
  for (const TouchableObject& object : objects) {
    if (object.motion) moving.push_back({static_cast<std::uint32_t>(objects_.size()), *object.motion});
    objects_.emplace_back(object, tool, *tool_tree_, *tool_layers_, tolerance_m, has_points);
  }
  moving_ = motion::MovingObjects(std::move(moving));
}

void NearContacts::go_to(double scene_s) noexcept {
  moving_.go_to(scene_s);
  for (const motion::Moved& moved : moving_.moved()) objects_[moved.object].X_WO = moving_.X_WO(moved);
}

void NearContacts::find(const Pose& X_WT, double dt_s, StageTimes& times) noexcept {
  Stopwatch watch;
  count_ = 0;
  pairs_ = 0;
  times.proximity_us = times.clusters_us = 0;
  for (std::uint32_t i = 0; i < objects_.size(); ++i) {
    FeltObject& object = objects_[i];
    const Pose X_OT = spatial::inverse(object.X_WO) * X_WT;
    object.pairs = object.crossed.mended(object.proximity.nearer_than(tolerance_m_, X_OT), tolerance_m_, X_OT);
    pairs_ += static_cast<std::uint32_t>(object.pairs.size());
    times.proximity_us += watch.lap_us();
    for (const Cluster& cluster : object.clustering.update(object.pairs, tolerance_m_, dt_s)) {
      if (count_ == near_.size()) break;
      NearContact& near = near_[count_++];
      near.id = cluster.id * static_cast<std::uint32_t>(objects_.size()) + i;
      near.object = i;
      near.cluster = cluster;
      near.triangles_s = near.triangles_t = {};
      near.depth = {};
      near.lacks_heights = false;
      near.outline_off_m = 0;
      near.layers = {};
    }
    times.clusters_us += watch.lap_us();
  }
}

double NearContacts::deepest_m(const NearContact& near) const noexcept {
  const contact::CrossedSheets& sheets = object_of(near).crossed;
  double thinnest_m = std::numeric_limits<double>::infinity();
  for (const auto& [pieces, thickness_m] : {std::pair(&near.cluster.pieces_s, sheets.thickness_s_m()),
                                            std::pair(&near.cluster.pieces_t, sheets.thickness_t_m())}) {
    for (const std::uint32_t piece : pieces->view()) thinnest_m = std::min(thinnest_m, thickness_m[piece]);
  }
  return contact::deepest_m(thinnest_m);
}

void NearContacts::restart() noexcept {
  for (FeltObject& object : objects_) object.clustering.restart();
  moving_.restart();
}

}  // namespace farfeel::contact_service
