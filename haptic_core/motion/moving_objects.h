// The objects of a scene that do not just stand: by a script, or by courses that are told while the scene lives, at one
// scene time after another.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/motion/course.h"
#include "haptic_core/motion/scripted_motion.h"

namespace farfeel::motion {

struct MovingObject {
  std::uint32_t object = 0;                   ///< index in the scene
  std::optional<ScriptedMotion> script = {};  ///< what it does until a course is told
  Course before = at_rest({}, true);          ///< the same where there is no script
};

/// A course, and whose.
struct ObjectCourse {
  std::uint32_t object = 0;  ///< index in the scene
  Course course;
};

/// What has become of one moving object since the scene time before.
struct Moved {
  std::uint32_t object = 0;
  spatial::Pose way_W;    ///< takes what is fixed to it from where that was, in W, to where it is
  spatial::Twist V_Wo_W;  ///< now, of its point at W's origin
  bool is_there = true;   ///< now
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
  /// A course is told, of one of these objects: of any other, or of one that has a newer course, it changes nothing.
  /// Returns whether it counts. Precondition: is_usable(course).
  bool set_out(const ObjectCourse&) noexcept;
  /// All that is known of an object's way, at any scene time since the course before the newest began.
  [[nodiscard]] Placement at(const Moved&, double scene_s) const noexcept;
  [[nodiscard]] std::span<const Moved> moved() const noexcept { return moved_; }
  /// null: it stands still.
  [[nodiscard]] const Moved* find(std::uint32_t object) const noexcept;
  [[nodiscard]] const spatial::Pose& X_WO(const Moved& moved) const noexcept { return X_WO_now_[index_of(moved)]; }
  /// Where what was fixed to a moving object then, in W, is now.
  [[nodiscard]] spatial::Pose way_since(const Moved&, double scene_s) const noexcept;

 private:
  struct Way {
    MovingObject of;
    std::array<Course, 2> courses;  // the newest first
    std::size_t count = 0;
    [[nodiscard]] Placement at(double scene_s) const noexcept;
  };
  [[nodiscard]] std::size_t index_of(const Moved& moved) const noexcept {
    return static_cast<std::size_t>(&moved - moved_.data());
  }
  std::vector<Way> ways_;
  std::vector<Moved> moved_;             // of each
  std::vector<spatial::Pose> X_WO_now_;  // of each
  bool has_begun_ = false;
};

}  // namespace farfeel::motion
