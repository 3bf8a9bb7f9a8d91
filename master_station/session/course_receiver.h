// Courses as they come in, for the haptic thread. What arrived does not come again: so the newest of each object waits
// here until that thread has room for it, or until the scene that it belongs to is there.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codecs/scene/scene_description.h"
#include "haptic_core/motion/moving_objects.h"
#include "master_station/session/haptic_lane.h"

namespace farfeel::master_station {

/// The io thread's.
class CourseReceiver {
 public:
  /// The slave's live session, before anything of it is given here. Another one tells all courses again, and may count
  /// their versions from the beginning: what the last one told does not count for it.
  void follow(std::uint32_t session) noexcept;
  /// Another scene is adopted, and the loop does not run: what is known counts for it from its beginning.
  void begin_scene(const codecs::SceneDescription&, HapticLane&) noexcept;
  /// Payload of a course, from anybody: what is none changes nothing but a counter.
  void on_course(std::span<const std::byte> payload);
  /// Gives the haptic thread what it has not got. Call it some times a second, and after courses came.
  void give(HapticLane&) noexcept;

  /// The newest of each object that may change, with versions that only grow here.
  [[nodiscard]] std::vector<motion::ObjectCourse> newest() const;
  [[nodiscard]] std::uint64_t malformed() const { return malformed_; }

 private:
  struct One {
    motion::Course newest;
    std::uint32_t told_version = 0;  // the slave's own number; 0: nothing is told in this session
    bool is_known = false, waits = false;
  };
  std::vector<One> all_{codecs::kMaxSceneObjects};
  std::vector<bool> may_change_;  // of the scene's objects
  std::uint32_t session_ = 0;     // that told versions are of
  std::uint64_t malformed_ = 0;
};

}  // namespace farfeel::master_station
