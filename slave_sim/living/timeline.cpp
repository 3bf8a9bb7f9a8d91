#include "slave_sim/living/timeline.h"

#include <fmt/format.h>

#include <map>

namespace farfeel::slave_sim {
namespace {

using Kind = TimedEdit::Kind;

/// How much lower than now each object's heights may get.
std::map<std::uint32_t, double> room_wanted_m(const std::vector<TimedEdit>& timeline) {
  std::map<std::uint32_t, double> room_m;  // stamps at one place add up
  for (const TimedEdit& edit : timeline) {
    if (edit.kind == Kind::kStamp) room_m[edit.object] += edit.depth_m;
  }
  return room_m;
}

std::string words_of(const TimedEdit& edit, const std::string& name) {
  switch (edit.kind) {
    case Kind::kStamp:
      return fmt::format("'{}' is stamped, {:.2f} mm deep", name, 1e3 * edit.depth_m);
    case Kind::kSpawn:
      return fmt::format("'{}' comes", name);
    case Kind::kMove:
      return fmt::format("'{}' moves for {:g} s", name, edit.takes_s);
    case Kind::kRemove:
      return fmt::format("'{}' goes", name);
  }
  return {};
}

}  // namespace

tl::expected<Timeline, SceneError> Timeline::of(World& world) {
  const std::vector<TimedEdit>& wanted = world.definition.timeline;
  std::map<std::uint32_t, geometry::HapticSurface> later;  // surfaces as they will be
  for (const auto& [object, room_m] : room_wanted_m(wanted)) {
    make_room(world.objects[object].asset.felt, room_m);
    later[object] = world.objects[object].asset.felt;
  }
  Timeline timeline;
  for (std::size_t n = 0; n < wanted.size(); ++n) {
    const TimedEdit& edit = wanted[n];
    const WorldObject& object = world.objects[edit.object];
    Edit ready{edit.at_s, words_of(edit, object.name), {}, {}};
    const spatial::Pose X_MO{{1, 0, 0, 0}, -object.asset.p_OM_O};
    if (edit.kind == Kind::kStamp) {
      geometry::HapticSurface& surface = later[edit.object];
      auto tiles =
          stamped(surface, edit.object + 1,
                  {spatial::transform_point(spatial::inverse(X_MO), edit.place_M), edit.radius_m, edit.depth_m});
      if (!tiles) {
        return tl::unexpected(
            SceneError{fmt::format("edit {} of the timeline, a stamp on '{}': {}", n + 1, object.name, tiles.error())});
      }
      for (const SurfaceEdit& tile : *tiles) surface.tiles[tile.where.tile] = tile.tile;
      ready.tiles = *std::move(tiles);
    } else {
      ready.change = {.object = edit.object, .takes_s = edit.takes_s, .is_there = edit.kind != Kind::kRemove};
      if (edit.X_WM) ready.change->X_WO = *edit.X_WM * X_MO;
    }
    timeline.edits_.push_back(std::move(ready));
  }
  return timeline;
}

std::vector<SurfaceEdit> Timeline::tiles_to_come() const {
  std::vector<SurfaceEdit> all;
  for (const Edit& edit : edits_) all.insert(all.end(), edit.tiles.begin(), edit.tiles.end());
  return all;
}

void Timeline::advance(double scene_s, SlaveSession& session, const std::function<void(const std::string&)>& say) {
  for (; !is_over() && edits_[next_].at_s <= scene_s; ++next_) {
    const Edit& edit = edits_[next_];
    for (const SurfaceEdit& tile : edit.tiles) session.edit(tile);
    if (edit.change) session.change(*edit.change);
    say(edit.words);
  }
}

}  // namespace farfeel::slave_sim
