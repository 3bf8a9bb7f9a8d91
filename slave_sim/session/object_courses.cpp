#include "slave_sim/session/object_courses.h"

#include <algorithm>
#include <utility>

#include "codecs/wire/course_message.h"
#include "transport/control_messages.h"

namespace farfeel::slave_sim {
namespace {

// With the scene: it is small, and what is felt depends on it.
constexpr std::uint8_t kUrgency = transport::kSceneUrgency;

std::uint64_t tag_of(const motion::ObjectCourse& told) {
  return std::uint64_t{told.object} << 32 | told.course.version;
}

}  // namespace

ObjectCourses::ObjectCourses(std::vector<motion::MovingObject> may_change) {
  for (const motion::MovingObject& object : may_change) all_.push_back({{object.object, object.before}});
  ways_ = motion::MovingObjects(std::move(may_change));
}

ObjectCourses::One* ObjectCourses::find(std::uint32_t object) {
  const auto at = std::ranges::find_if(all_, [&](const One& one) { return one.told.object == object; });
  return at == all_.end() ? nullptr : &*at;
}

void ObjectCourses::set_out(One& one, motion::Course course) {
  course.version = one.told.course.version + 1;
  one.told.course = course;
  one.is_due = true;
  (void)ways_.set_out(one.told);
}

std::optional<motion::ObjectCourse> ObjectCourses::change(const ObjectChange& change, double from_s) {
  One* const one = find(change.object);
  if (one == nullptr) return std::nullopt;
  const motion::Placement then = ways_.at(*ways_.find(change.object), from_s);
  const bool goes = then.is_there && change.is_there;
  const spatial::Pose X_to_WO = change.X_WO.value_or(then.X_WO);
  set_out(*one, {.from_s = from_s,
                 .takes_s = goes ? change.takes_s : 0,
                 .X_from_WO = goes ? then.X_WO : X_to_WO,
                 .X_to_WO = X_to_WO,
                 .is_there = change.is_there});
  return one->told;
}

std::vector<motion::ObjectCourse> ObjectCourses::begin_session() {
  std::vector<motion::ObjectCourse> all;
  for (One& one : all_) {
    set_out(one, motion::at_rest(one.told.course.X_to_WO, one.told.course.is_there));
    all.push_back(one.told);
  }
  return all;
}

std::optional<std::uint8_t> ObjectCourses::urgency(std::int64_t) {
  const bool is_any_due = std::ranges::any_of(all_, [](const One& one) { return one.is_due; });
  return is_any_due ? std::optional(kUrgency) : std::nullopt;
}

std::optional<transport::BulkSource::Item> ObjectCourses::next(std::span<std::byte> to, std::int64_t) {
  const auto due = std::ranges::find_if(all_, [](const One& one) { return one.is_due; });
  if (due == all_.end()) return std::nullopt;
  const std::size_t bytes = codecs::write(due->told, to);
  if (bytes == 0) return std::nullopt;
  due->is_due = false;
  return Item{transport::BulkType::kCourse, bytes, tag_of(due->told)};
}

void ObjectCourses::on_arrived(std::uint64_t, std::int64_t) {}

void ObjectCourses::on_lost(std::uint64_t tag, std::int64_t) {
  One* const one = find(static_cast<std::uint32_t>(tag >> 32));
  if (one != nullptr && tag_of(one->told) == tag) one->is_due = true;
}

}  // namespace farfeel::slave_sim
