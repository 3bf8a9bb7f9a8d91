// The objects of a scene that move by a script, at one scene time after another.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/motion/scripted_motion.h"

namespace farfeel::motion {

struct MovingObject {
  std::uint32_t object = 0;  ///< index in the scene
  ScriptedMotion script;
};

/// What has become of one moving object since the scene time before.
struct Moved {
  std::uint32_t object = 0;
  spatial::Pose way_W;    ///< takes what is fixed to it from where that was, in W, to where it is
  spatial::Twist V_Wo_W;  ///< now, of its point at W's origin
  /// Of its point at p_W.
  [[nodiscard]] spatial::Twist twist_at(const glm::dvec3& p_W) const noexcept {
    return {V_Wo_W.angular_rad_s, spatial::velocity_at(V_Wo_W, p_W)};
  }
};

/// Realtime-safe but for its construction; one thread.
class MovingObjects {
 public:
  MovingObjects() = default;
  explicit MovingObjects(std::vector<MovingObject> objects);

  /// The scene's time is now scene_s. Nothing has moved at the first call, and at the first after a restart.
  void go_to(double scene_s) noexcept;
  void restart() noexcept { has_begun_ = false; }
  [[nodiscard]] std::span<const Moved> moved() const noexcept { return moved_; }
  /// null: it stands still.
  [[nodiscard]] const Moved* find(std::uint32_t object) const noexcept;
  [[nodiscard]] const spatial::Pose& X_WO(const Moved& moved) const noexcept {
    return X_WO_now_[static_cast<std::size_t>(&moved - moved_.data())];
  }
  /// Where what was fixed to a moving object then, in W, is now.
  [[nodiscard]] spatial::Pose way_since(const Moved&, double scene_s) const noexcept;

 private:
  std::vector<MovingObject> objects_;
  std::vector<Moved> moved_;             // of each
  std::vector<spatial::Pose> X_WO_now_;  // of each
  bool has_begun_ = false;
};

}  // namespace farfeel::motion
