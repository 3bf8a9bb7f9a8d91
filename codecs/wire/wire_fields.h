// Fields that several messages of the haptic lane have, written and read.
#pragma once

#include <span>

#include "codecs/wire/haptic_limits.h"
#include "haptic_core/contact/curvature.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/teleoperation/controller.h"
#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {

/// Reads values and remembers the first fault among them. Realtime-safe.
class CheckedReader {
 public:
  explicit CheckedReader(std::span<const std::byte> from) noexcept : reader_(from) {}

  double f32(double low, double high) noexcept { return checked(reader_.f32(), low, high); }
  double f64(double low, double high) noexcept { return checked(reader_.f64(), low, high); }
  // Braces fix the order of evaluation; a function call's arguments would not.
  glm::dvec3 vector_f64(double bound) noexcept {
    return glm::dvec3{f64(-bound, bound), f64(-bound, bound), f64(-bound, bound)};
  }
  glm::dvec3 vector_f32(double bound) noexcept {
    return glm::dvec3{f32(-bound, bound), f32(-bound, bound), f32(-bound, bound)};
  }
  spatial::Pose pose() noexcept;
  teleoperation::LineValue line() noexcept;
  contact::Curvature curvature() noexcept;
  /// Never negative, so that the difference of two cannot overflow.
  std::int64_t time() noexcept {
    const std::int64_t t_ns = reader_.i64();
    if (t_ns < 0) refuse();
    return t_ns;
  }

  transport::ByteReader& raw() noexcept { return reader_; }
  void refuse(Fault fault = Fault::kRange) noexcept {
    if (fault_ == Fault::kNone) fault_ = fault;
  }
  double checked(double value, double low, double high) noexcept;
  [[nodiscard]] Fault fault() const noexcept { return reader_.ok() ? fault_ : Fault::kLength; }

 private:
  transport::ByteReader reader_;
  Fault fault_ = Fault::kNone;
};

/// The lower three bytes.
void write_u24(transport::ByteWriter&, std::uint32_t) noexcept;
void write_i24(transport::ByteWriter&, std::int32_t) noexcept;
[[nodiscard]] std::uint32_t read_u24(transport::ByteReader&) noexcept;
[[nodiscard]] std::int32_t read_i24(transport::ByteReader&) noexcept;

void write_f64(transport::ByteWriter&, const glm::dvec3&) noexcept;
void write_f32(transport::ByteWriter&, const glm::dvec3&) noexcept;
/// 56 bytes: position, quaternion.
void write_pose(transport::ByteWriter&, const spatial::Pose&) noexcept;
/// 56 bytes.
void write_line(transport::ByteWriter&, const teleoperation::LineValue&) noexcept;
/// 42 bytes, each entry the upper half of a single: three significant digits are many for a second derivative.
void write_curvature(transport::ByteWriter&, const contact::Curvature&) noexcept;

}  // namespace farfeel::codecs
