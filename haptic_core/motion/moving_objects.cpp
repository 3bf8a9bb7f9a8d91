#include "haptic_core/motion/moving_objects.h"

#include <algorithm>
#include <utility>

namespace farfeel::motion {

MovingObjects::MovingObjects(std::vector<MovingObject> objects) : moved_(objects.size()), X_WO_now_(objects.size()) {
  for (std::size_t i = 0; i < objects.size(); ++i) moved_[i].object = objects[i].object;
  for (MovingObject& object : objects) ways_.push_back({std::move(object), {}, 0});
}

Placement MovingObjects::Way::at(double scene_s) const noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    if (scene_s >= courses[i].from_s) return placement(courses[i], scene_s);
  }
  if (!of.script) return placement(of.before, scene_s);
  Placement scripted = of.script->at(scene_s);
  scripted.is_there = of.before.is_there;
  return scripted;
}

bool MovingObjects::set_out(const ObjectCourse& told) noexcept {
  const Moved* const moved = find(told.object);
  if (moved == nullptr) return false;
  Way& way = ways_[index_of(*moved)];
  if (way.count > 0 && told.course.version <= way.courses[0].version) return false;
  way.courses[1] = way.courses[0];
  way.courses[0] = told.course;
  way.count = std::min(way.count + 1, way.courses.size());
  return true;
}

Placement MovingObjects::at(const Moved& moved, double scene_s) const noexcept {
  return ways_[index_of(moved)].at(scene_s);
}

void MovingObjects::go_to(double scene_s) noexcept {
  for (std::size_t i = 0; i < ways_.size(); ++i) {
    const Placement now = ways_[i].at(scene_s);
    // What comes again is nowhere near where it went.
    const bool goes_on = has_begun_ && moved_[i].is_there && now.is_there;
    moved_[i].way_W = goes_on ? now.X_WO * spatial::inverse(X_WO_now_[i]) : spatial::Pose{};
    moved_[i].V_Wo_W = {now.V_WO_W.angular_rad_s, spatial::velocity_at(now.V_WO_W, -now.X_WO.p)};
    moved_[i].is_there = now.is_there;
    X_WO_now_[i] = now.X_WO;
  }
  has_begun_ = true;
}

const Moved* MovingObjects::find(std::uint32_t object) const noexcept {
  const auto found = std::find_if(moved_.begin(), moved_.end(), [&](const Moved& m) { return m.object == object; });
  return found == moved_.end() ? nullptr : &*found;
}

spatial::Pose MovingObjects::way_since(const Moved& moved, double scene_s) const noexcept {
  return X_WO_now_[index_of(moved)] * spatial::inverse(at(moved, scene_s).X_WO);
}

}  // namespace farfeel::motion
