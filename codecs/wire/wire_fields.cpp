#include "codecs/wire/wire_fields.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace farfeel::codecs {

using transport::ByteReader;
using transport::ByteWriter;

std::string_view to_string(Fault fault) noexcept {
  switch (fault) {
    case Fault::kNone:
      return "none";
    case Fault::kLength:
      return "wrong length";
    case Fault::kNotFinite:
      return "not finite";
    case Fault::kRange:
      return "out of range";
    case Fault::kOld:
      return "old";
    case Fault::kNoBase:
      return "refers to what is not known";
  }
  return "unknown";
}

double CheckedReader::checked(double value, double low, double high) noexcept {
  if (fault_ != Fault::kNone) return value;
  if (!std::isfinite(value)) {
    fault_ = Fault::kNotFinite;
  } else if (value < low || value > high) {
    fault_ = Fault::kRange;
  }
  return value;
}

spatial::Pose CheckedReader::pose() noexcept {
  spatial::Pose X;
  X.p = vector_f64(kMaxCoordinate_m);
  for (double* c : {&X.R.w, &X.R.x, &X.R.y, &X.R.z}) *c = f64(-1.1, 1.1);
  if (fault_ == Fault::kNone && !spatial::is_valid(X)) fault_ = Fault::kRange;
  return X;
}

teleoperation::LineValue CheckedReader::line() noexcept {
  teleoperation::LineValue line;
  for (int i = 0; i < 6; ++i) line.value[i] = f64(-kMaxLineValue, kMaxLineValue);
  line.energy_in_J = f64(0, 1e12);
  return line;
}

/// All zero: none is known.
contact::Curvature CheckedReader::curvature() noexcept {
  contact::Curvature curvature;
  for (float& entry : curvature.upper) {
    const auto bits = std::uint32_t{reader_.u16()} << 16;
    entry = std::bit_cast<float>(bits);
    curvature.is_known = curvature.is_known || entry != 0;
    checked(static_cast<double>(entry), -1.01 * kMaxCurvature, 1.01 * kMaxCurvature);
  }
  return curvature;
}

void write_u24(ByteWriter& w, std::uint32_t v) noexcept {
  w.u16(static_cast<std::uint16_t>(v));
  w.u8(static_cast<std::uint8_t>(v >> 16));
}

void write_i24(ByteWriter& w, std::int32_t v) noexcept {
  write_u24(w, static_cast<std::uint32_t>(v));
}

std::uint32_t read_u24(ByteReader& r) noexcept {
  const std::uint32_t low = r.u16(), high = r.u8();
  return low | high << 16;
}

std::int32_t read_i24(ByteReader& r) noexcept {
  return std::bit_cast<std::int32_t>(read_u24(r) << 8) >> 8;
}

void write_f64(ByteWriter& w, const glm::dvec3& v) noexcept {
  for (int i = 0; i < 3; ++i) w.f64(v[i]);
}

void write_f32(ByteWriter& w, const glm::dvec3& v) noexcept {
  for (int i = 0; i < 3; ++i) w.f32(v[i]);
}

void write_pose(ByteWriter& w, const spatial::Pose& X) noexcept {
  write_f64(w, X.p);
  for (const double c : {X.R.w, X.R.x, X.R.y, X.R.z}) w.f64(c);
}

void write_line(ByteWriter& w, const teleoperation::LineValue& line) noexcept {
  for (int i = 0; i < 6; ++i) w.f64(line.value[i]);
  w.f64(line.energy_in_J);
}

void write_curvature(ByteWriter& w, const contact::Curvature& curvature) noexcept {
  for (const float entry : curvature.upper) {
    const double held = std::clamp<double>(entry, -kMaxCurvature, kMaxCurvature);
    const auto bits = std::isnan(held) ? 0x7FC0'0000u : std::bit_cast<std::uint32_t>(static_cast<float>(held));
    w.u16(curvature.is_known ? static_cast<std::uint16_t>((bits + 0x7FFF + ((bits >> 16) & 1)) >> 16) : 0);
  }
}

}  // namespace farfeel::codecs
