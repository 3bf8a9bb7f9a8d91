// What the objects that may change do, and what of it each peer has still to be told. The io thread's.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/motion/moving_objects.h"
#include "slave_sim/edits/object_change.h"
#include "transport/bulk/bulk_source.h"

namespace farfeel::slave_sim {

class ObjectCourses {
 public:
  /// Those of a scene that may change, as they are in the beginning.
  explicit ObjectCourses(std::vector<motion::MovingObject> may_change);

  /// The course that makes the change, from a scene time on; nothing, where no such object may change.
  [[nodiscard]] std::optional<motion::ObjectCourse> change(const ObjectChange&, double from_s);
  /// A master's session begins, in which scene time may begin anew: all have come to where they were going, and are
  /// told.
  [[nodiscard]] std::vector<motion::ObjectCourse> begin_session();
  /// The newest of each, in no order that means anything; versions grow from 0, which is the scene's own.
  [[nodiscard]] std::span<const motion::ObjectCourse> newest() const { return newest_; }

 private:
  void set_out(motion::ObjectCourse&, motion::Course);

  std::vector<motion::ObjectCourse> newest_;
  motion::MovingObjects ways_;
};

/// Tells one peer the courses: a source of its bulk lane. One that was lost is sent again unless it is not the newest
/// any more.
class CourseFeed final : public transport::BulkSource {
 public:
  /// They must outlive it.
  explicit CourseFeed(const ObjectCourses& courses) : courses_(courses), told_(courses.newest().size()) {}
  /// Another session: nothing has been told in it.
  void restart() { told_.assign(told_.size(), 0); }

  [[nodiscard]] std::optional<std::uint8_t> urgency(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<Item> next(std::span<std::byte> to, std::int64_t now_ns) override;
  void on_arrived(std::uint64_t, std::int64_t) override {}
  void on_lost(std::uint64_t tag, std::int64_t now_ns) override;

 private:
  [[nodiscard]] std::optional<std::size_t> due() const;

  const ObjectCourses& courses_;
  std::vector<std::uint32_t> told_;  // versions, as in newest()
};

}  // namespace farfeel::slave_sim
