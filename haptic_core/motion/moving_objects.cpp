#include "haptic_core/motion/moving_objects.h"

#include <algorithm>
#include <utility>

namespace farfeel::motion {

MovingObjects::MovingObjects(std::vector<MovingObject> objects)
    : objects_(std::move(objects)), moved_(objects_.size()), X_WO_now_(objects_.size()) {
  for (std::size_t i = 0; i < objects_.size(); ++i) moved_[i].object = objects_[i].object;
}

void MovingObjects::go_to(double scene_s) noexcept {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const Placement now = objects_[i].script.at(scene_s);
    moved_[i].way_W = has_begun_ ? now.X_WO * spatial::inverse(X_WO_now_[i]) : spatial::Pose{};
    moved_[i].V_Wo_W = {now.V_WO_W.angular_rad_s, spatial::velocity_at(now.V_WO_W, -now.X_WO.p)};
    X_WO_now_[i] = now.X_WO;
  }
  has_begun_ = true;
}

const Moved* MovingObjects::find(std::uint32_t object) const noexcept {
  const auto found = std::find_if(moved_.begin(), moved_.end(), [&](const Moved& m) { return m.object == object; });
  return found == moved_.end() ? nullptr : &*found;
}

spatial::Pose MovingObjects::way_since(const Moved& moved, double scene_s) const noexcept {
  const auto i = static_cast<std::size_t>(&moved - moved_.data());
  return X_WO_now_[i] * spatial::inverse(objects_[i].script.at(scene_s).X_WO);
}

}  // namespace farfeel::motion
