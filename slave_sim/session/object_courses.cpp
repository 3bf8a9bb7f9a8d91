#include "slave_sim/session/object_courses.h"

#include <algorithm>
#include <utility>

#include "codecs/wire/course_message.h"
#include "transport/control_messages.h"

namespace farfeel::slave_sim {
namespace {

// With the scene: it is small, and what is felt depends on it.
constexpr std::uint8_t kUrgency = transport::kSceneUrgency;

std::uint64_t tag_of(std::size_t place, std::uint32_t version) {
  return std::uint64_t{place} << 32 | version;
}

}  // namespace

ObjectCourses::ObjectCourses(std::vector<motion::MovingObject> may_change) {
  for (const motion::MovingObject& object : may_change) newest_.push_back({object.object, object.before});
  ways_ = motion::MovingObjects(std::move(may_change));
}

void ObjectCourses::set_out(motion::ObjectCourse& told, motion::Course course) {
  course.version = told.course.version + 1;
  told.course = course;
  (void)ways_.set_out(told);
}

std::optional<motion::ObjectCourse> ObjectCourses::change(const ObjectChange& change, double from_s) {
  const auto told = std::ranges::find(newest_, change.object, &motion::ObjectCourse::object);
  if (told == newest_.end()) return std::nullopt;
  const motion::Placement then = ways_.at(*ways_.find(change.object), from_s);
  const bool goes = then.is_there && change.is_there;
  const spatial::Pose X_to_WO = change.X_WO.value_or(then.X_WO);
  set_out(*told, {.from_s = from_s,
                  .takes_s = goes ? change.takes_s : 0,
                  .X_from_WO = goes ? then.X_WO : X_to_WO,
                  .X_to_WO = X_to_WO,
                  .is_there = change.is_there});
  return *told;
}

std::vector<motion::ObjectCourse> ObjectCourses::begin_session() {
  for (motion::ObjectCourse& told : newest_) set_out(told, motion::at_rest(told.course.X_to_WO, told.course.is_there));
  return newest_;
}

std::optional<std::size_t> CourseFeed::due() const {
  const auto newest = courses_.newest();
  for (std::size_t i = 0; i < newest.size(); ++i) {
    if (newest[i].course.version > told_[i]) return i;
  }
  return std::nullopt;
}

std::optional<std::uint8_t> CourseFeed::urgency(std::int64_t) {
  return due() ? std::optional(kUrgency) : std::nullopt;
}

std::optional<transport::BulkSource::Item> CourseFeed::next(std::span<std::byte> to, std::int64_t) {
  const auto place = due();
  if (!place) return std::nullopt;
  const motion::ObjectCourse& told = courses_.newest()[*place];
  const std::size_t bytes = codecs::write(told, to);
  if (bytes == 0) return std::nullopt;
  told_[*place] = told.course.version;
  return Item{transport::BulkType::kCourse, bytes, tag_of(*place, told.course.version)};
}

void CourseFeed::on_lost(std::uint64_t tag, std::int64_t) {
  const auto place = static_cast<std::size_t>(tag >> 32);
  if (place < told_.size() && tag_of(place, told_[place]) == tag) told_[place] = 0;
}

}  // namespace farfeel::slave_sim
