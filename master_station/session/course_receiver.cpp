#include "master_station/session/course_receiver.h"

#include <utility>

#include "codecs/wire/course_message.h"

namespace farfeel::master_station {

void CourseReceiver::follow(std::uint32_t session) noexcept {
  if (session == std::exchange(session_, session)) return;
  for (One& one : all_) one.told_version = 0;
}

void CourseReceiver::begin_scene(const codecs::SceneDescription& scene, HapticLane& lane) noexcept {
  motion::ObjectCourse of_other_scene;
  while (lane.take_course(of_other_scene)) continue;
  may_change_.clear();
  for (const codecs::SceneObject& object : scene.objects) may_change_.push_back(object.may_change);
  for (One& one : all_) one.waits = one.is_known = one.told_version > 0;
}

void CourseReceiver::on_course(std::span<const std::byte> payload) {
  const auto told = codecs::read_course(payload);
  if (!told || told->object >= all_.size()) {
    ++malformed_;
    return;
  }
  One& one = all_[told->object];
  if (told->course.version <= one.told_version) return;
  const std::uint32_t version = one.newest.version + 1;
  one = {told->course, told->course.version, true, true};
  one.newest.version = version;
}

void CourseReceiver::give(HapticLane& lane) noexcept {
  for (std::uint32_t i = 0; i < may_change_.size(); ++i) {
    if (may_change_[i] && all_[i].waits) all_[i].waits = !lane.set_out({i, all_[i].newest});
  }
}

std::vector<motion::ObjectCourse> CourseReceiver::newest() const {
  std::vector<motion::ObjectCourse> all;
  for (std::uint32_t i = 0; i < may_change_.size(); ++i) {
    if (may_change_[i] && all_[i].is_known) all.push_back({i, all_[i].newest});
  }
  return all;
}

}  // namespace farfeel::master_station
