// What the objects that may change do, and what of it the master has still to be told: the io thread's, and a source of
// the bulk lane. A course that was lost is sent again unless it is not the newest any more.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "haptic_core/motion/moving_objects.h"
#include "slave_sim/edits/object_change.h"
#include "transport/bulk/bulk_source.h"

namespace farfeel::slave_sim {

class ObjectCourses final : public transport::BulkSource {
 public:
  /// Those of a scene that may change, as they are in the beginning.
  explicit ObjectCourses(std::vector<motion::MovingObject> may_change);

  /// The course that makes the change, from a scene time on; nothing, where no such object may change.
  [[nodiscard]] std::optional<motion::ObjectCourse> change(const ObjectChange&, double from_s);
  /// Another session begins, in which scene time may begin anew: all have come to where they were going, and are told.
  [[nodiscard]] std::vector<motion::ObjectCourse> begin_session();

  [[nodiscard]] std::optional<std::uint8_t> urgency(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<Item> next(std::span<std::byte> to, std::int64_t now_ns) override;
  void on_arrived(std::uint64_t tag, std::int64_t now_ns) override;
  void on_lost(std::uint64_t tag, std::int64_t now_ns) override;

 private:
  struct One {
    motion::ObjectCourse told;  // the newest
    bool is_due = false;        // and not sent, or lost
  };
  [[nodiscard]] One* find(std::uint32_t object);
  void set_out(One&, motion::Course);

  std::vector<One> all_;
  motion::MovingObjects ways_;
};

}  // namespace farfeel::slave_sim
