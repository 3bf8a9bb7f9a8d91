#include "codecs/wire/course_message.h"

#include "codecs/wire/wire_fields.h"

namespace farfeel::codecs {

std::size_t write(const motion::ObjectCourse& told, std::span<std::byte> to) noexcept {
  transport::ByteWriter w(to);
  w.u32(told.object);
  w.u32(told.course.version);
  w.f64(told.course.from_s);
  w.f64(told.course.takes_s);
  w.u8(told.course.is_there ? 1 : 0);
  write_pose(w, told.course.X_from_WO);
  write_pose(w, told.course.X_to_WO);
  return w.ok() ? w.size() : 0;
}

std::optional<motion::ObjectCourse> read_course(std::span<const std::byte> payload) noexcept {
  if (payload.size() != kCourseBytes) return std::nullopt;
  CheckedReader r(payload);
  motion::ObjectCourse told;
  told.object = r.raw().u32();
  told.course.version = r.raw().u32();
  told.course.from_s = r.f64(0, kLatestCourse_s);
  told.course.takes_s = r.f64(0, motion::kLongestCourse_s);
  const std::uint8_t is_there = r.raw().u8();
  told.course.is_there = is_there == 1;
  told.course.X_from_WO = r.pose();
  told.course.X_to_WO = r.pose();
  if (r.fault() != Fault::kNone || told.course.version == 0 || is_there > 1 || !motion::is_usable(told.course))
    return std::nullopt;
  return told;
}

}  // namespace farfeel::codecs
