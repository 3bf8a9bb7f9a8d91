#include "codecs/wire/haptic_messages.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::codecs {
namespace {

using transport::ByteReader;
using transport::ByteWriter;

void write_f64(ByteWriter& w, const glm::dvec3& v) {
  for (int i = 0; i < 3; ++i) w.f64(v[i]);
}
void write_f32(ByteWriter& w, const glm::dvec3& v) {
  for (int i = 0; i < 3; ++i) w.f32(v[i]);
}
void write_pose(ByteWriter& w, const spatial::Pose& X) {
  write_f64(w, X.p);
  for (const double c : {X.R.w, X.R.x, X.R.y, X.R.z}) w.f64(c);
}
void write_times(ByteWriter& w, const LinkTimes& times) {
  w.i64(times.t_send_ns);
  w.i64(times.t_echo_ns);
  w.u32(times.hold_us);
}

void write_line(ByteWriter& w, const teleoperation::LineValue& line) {
  for (int i = 0; i < 6; ++i) w.f64(line.value[i]);
  w.f64(line.energy_in_J);
}

constexpr std::uint16_t kWishCurvature = 1, kWishWaves = 2, kWishPassivity = 4;

std::uint16_t wishes_of(const PoseSample& sample) {
  using teleoperation::Controller;
  const bool has_waves = sample.controller == Controller::kWaves,
             has_passivity = sample.controller == Controller::kPassivity;
  return static_cast<std::uint16_t>((sample.wants_curvature ? kWishCurvature : 0) | (has_waves ? kWishWaves : 0) |
                                    (has_passivity ? kWishPassivity : 0));
}

/// Reads values and remembers the first fault among them.
class CheckedReader {
 public:
  explicit CheckedReader(std::span<const std::byte> from) : reader_(from) {}

  double f32(double low, double high) { return checked(reader_.f32(), low, high); }
  double f64(double low, double high) { return checked(reader_.f64(), low, high); }
  // Braces fix the order of evaluation; a function call's arguments would not.
  glm::dvec3 vector_f64(double bound) { return glm::dvec3{f64(-bound, bound), f64(-bound, bound), f64(-bound, bound)}; }
  glm::dvec3 vector_f32(double bound) { return glm::dvec3{f32(-bound, bound), f32(-bound, bound), f32(-bound, bound)}; }
  spatial::Pose pose() {
    spatial::Pose X;
    X.p = vector_f64(kMaxCoordinate_m);
    for (double* c : {&X.R.w, &X.R.x, &X.R.y, &X.R.z}) *c = f64(-1.1, 1.1);
    if (fault_ == Fault::kNone && !spatial::is_valid(X)) fault_ = Fault::kRange;
    return X;
  }
  teleoperation::LineValue line() {
    teleoperation::LineValue line;
    for (int i = 0; i < 6; ++i) line.value[i] = f64(-kMaxLineValue, kMaxLineValue);
    line.energy_in_J = f64(0, 1e12);
    return line;
  }
  LinkTimes times() {
    LinkTimes t;
    t.t_send_ns = time();
    t.t_echo_ns = time();
    t.hold_us = reader_.u32();
    return t;
  }
  /// Never negative, so that the difference of two cannot overflow.
  std::int64_t time() {
    const std::int64_t t_ns = reader_.i64();
    if (t_ns < 0) refuse();
    return t_ns;
  }
  ByteReader& raw() { return reader_; }
  void refuse() {
    if (fault_ == Fault::kNone) fault_ = Fault::kRange;
  }
  [[nodiscard]] Fault fault() const { return reader_.ok() ? fault_ : Fault::kLength; }

 private:
  double checked(double v, double low, double high) {
    if (fault_ != Fault::kNone) return v;
    if (!std::isfinite(v)) {
      fault_ = Fault::kNotFinite;
    } else if (v < low || v > high) {
      fault_ = Fault::kRange;
    }
    return v;
  }

  ByteReader reader_;
  Fault fault_ = Fault::kNone;
};

void write_contact(ByteWriter& w, const contact::Contact& c) {
  w.u32(c.id);
  w.u32(c.object);
  write_f64(w, c.p_WC_W);
  w.f32(c.depth_m);
  write_f32(w, c.nhat_ST_W);
  for (int i = 0; i < 6; ++i) w.f32(c.gradient[i]);
  w.f32(c.lateral_range_m);
  w.f32(c.material.stiffness_N_per_m);
  w.f32(c.material.damping_Ns_per_m);
  w.f32(c.material.static_friction);
  w.f32(c.material.dynamic_friction);
  w.u8(static_cast<std::uint8_t>(c.doubts & contact::kAllDoubts));
}

/// The upper half of a single, rounded to nearest: three significant digits are many for a second derivative.
std::uint16_t half_of(float value) {
  const double held = std::clamp<double>(value, -kMaxCurvature, kMaxCurvature);
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(held));
  return static_cast<std::uint16_t>((bits + 0x7FFF + ((bits >> 16) & 1)) >> 16);
}

void write_curvature(ByteWriter& w, const contact::Curvature& curvature) {
  for (const float entry : curvature.upper) w.u16(curvature.is_known ? half_of(entry) : 0);
}

/// All zero: none is known.
Fault read_curvature(CheckedReader& r, contact::Curvature& curvature) {
  for (float& entry : curvature.upper) {
    const auto bits = std::uint32_t{r.raw().u16()} << 16;
    entry = std::bit_cast<float>(bits);
    curvature.is_known = curvature.is_known || entry != 0;
    if (!std::isfinite(entry)) return Fault::kNotFinite;
    if (std::abs(entry) > 1.01 * kMaxCurvature) return Fault::kRange;
  }
  return Fault::kNone;
}

Fault read_contact(std::span<const std::byte> record, contact::Contact& c) {
  CheckedReader r(record);
  c.id = r.raw().u32();
  c.object = r.raw().u32();
  c.p_WC_W = r.vector_f64(kMaxCoordinate_m);
  c.depth_m = r.f32(-kMaxCoordinate_m, kMaxCoordinate_m);
  c.nhat_ST_W = r.vector_f32(1.1);
  for (int i = 0; i < 6; ++i) c.gradient[i] = r.f32(-kMaxGradient, kMaxGradient);
  c.lateral_range_m = r.f32(0, kMaxCoordinate_m);
  c.material.stiffness_N_per_m = r.f32(0, kMaxStiffness_N_per_m);
  c.material.damping_Ns_per_m = r.f32(0, kMaxDamping_Ns_per_m);
  c.material.static_friction = r.f32(0, kMaxFriction);
  c.material.dynamic_friction = r.f32(0, kMaxFriction);
  c.doubts = r.raw().u8();
  if ((c.doubts & ~contact::kAllDoubts) != 0) r.refuse();
  if (r.fault() != Fault::kNone) return r.fault();
  if (record.size() >= kContactRecordBytes + kCurvatureBytes) {
    if (const Fault fault = read_curvature(r, c.curvature); fault != Fault::kNone) return fault;
  }
  const double length = glm::length(c.nhat_ST_W);
  if (std::abs(length - 1) > kNormalTolerance) return Fault::kRange;
  c.nhat_ST_W /= length;
  return Fault::kNone;
}

bool has_curvature(const contact::ContactSet& set, std::size_t count) {
  return std::any_of(set.contacts.begin(), set.contacts.begin() + static_cast<std::ptrdiff_t>(count),
                     [](const contact::Contact& c) { return c.curvature.is_known; });
}

/// Which contacts go: flags, true for the `most` deepest; of equally deep ones the first.
std::array<bool, contact::kMaxContacts> chosen(const contact::ContactSet& set, std::size_t count, std::size_t most) {
  // NaN compares with nothing, which would break the sort; it goes last, and the reader refuses it.
  const auto depth = [&](std::uint32_t i) {
    const double depth_m = set.contacts[i].depth_m;
    return std::isnan(depth_m) ? -std::numeric_limits<double>::infinity() : depth_m;
  };
  std::array<std::uint32_t, contact::kMaxContacts> order;
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(count);
  std::iota(order.begin(), end, 0u);
  std::sort(order.begin(), end,
            [&](std::uint32_t a, std::uint32_t b) { return depth(a) > depth(b) || (depth(a) == depth(b) && a < b); });
  std::array<bool, contact::kMaxContacts> flags{};
  for (std::size_t i = 0; i < std::min(count, most); ++i) flags[order[i]] = true;
  return flags;
}

}  // namespace

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
  }
  return "unknown";
}

std::size_t write(const PoseSample& sample, std::span<std::byte> to) noexcept {
  ByteWriter w(to);
  write_times(w, sample.times);
  w.u32(sample.sequence);
  w.i64(sample.time_ns);
  write_pose(w, sample.X_WT);
  write_f32(w, sample.V_WT_W.angular_rad_s);
  write_f32(w, sample.V_WT_W.linear_m_s);
  const std::uint16_t wishes = wishes_of(sample);
  w.u16(wishes);
  w.u16(static_cast<std::uint16_t>(std::min(sample.ahead_us, kMostAhead_us)));
  if (wishes > kWishCurvature) write_line(w, sample.line);
  return w.ok() ? w.size() : 0;
}

Fault read(std::span<const std::byte> payload, PoseSample& out) noexcept {
  if (payload.size() != kPoseSampleBytes && payload.size() != kPoseSampleBytes + kLineBytes) return Fault::kLength;
  CheckedReader r(payload);
  PoseSample sample;
  sample.times = r.times();
  sample.sequence = r.raw().u32();
  sample.time_ns = r.time();
  sample.X_WT = r.pose();
  sample.V_WT_W.angular_rad_s = r.vector_f32(kMaxSpeed);
  sample.V_WT_W.linear_m_s = r.vector_f32(kMaxSpeed);
  const std::uint16_t wishes = r.raw().u16();
  sample.wants_curvature = (wishes & kWishCurvature) != 0;
  sample.controller = (wishes & kWishWaves) != 0       ? teleoperation::Controller::kWaves
                      : (wishes & kWishPassivity) != 0 ? teleoperation::Controller::kPassivity
                                                       : teleoperation::Controller::kOurs;
  sample.ahead_us = r.raw().u16();
  if (wishes != wishes_of(sample) || sample.ahead_us > kMostAhead_us) r.refuse();
  const bool has_line = payload.size() > kPoseSampleBytes;
  if (has_line != (wishes > kWishCurvature)) return Fault::kLength;
  if (has_line) sample.line = r.line();
  if (r.fault() != Fault::kNone) return r.fault();
  out = sample;
  return Fault::kNone;
}

std::size_t contacts_that_fit(const ContactAnswer& answer) noexcept {
  const std::size_t count = std::min<std::size_t>(answer.set.count, contact::kMaxContacts);
  const std::size_t block = kContactBlockBytes + (answer.line ? kLineBytes : 0);
  const std::size_t record = kContactRecordBytes + (has_curvature(answer.set, count) ? kCurvatureBytes : 0);
  return std::min(count, (kMaxHapticPayloadBytes - block) / record);
}

std::size_t write(const ContactAnswer& answer, std::span<std::byte> to) noexcept {
  const contact::ContactSet& set = answer.set;
  const std::size_t count = std::min<std::size_t>(set.count, contact::kMaxContacts);
  const std::size_t sent = contacts_that_fit(answer);
  const bool is_curved = has_curvature(set, count);
  ByteWriter w(to);
  w.u16(static_cast<std::uint16_t>(kContactBlockBytes + (answer.line ? kLineBytes : 0)));
  w.u16(static_cast<std::uint16_t>(kContactRecordBytes + (is_curved ? kCurvatureBytes : 0)));
  w.u16(static_cast<std::uint16_t>(sent));
  w.u16(static_cast<std::uint16_t>(count - sent));
  write_times(w, answer.times);
  w.u32(set.pose_sequence);
  w.i64(set.pose_time_ns);
  write_pose(w, set.X_WT);
  write_f32(w, set.F_To_W.torque_Nm);
  write_f32(w, set.F_To_W.force_N);
  w.u32(set.pairs_near);
  if (answer.line) write_line(w, *answer.line);
  const auto flags = chosen(set, count, sent);
  for (std::size_t i = 0; i < count; ++i) {
    if (!flags[i]) continue;
    write_contact(w, set.contacts[i]);
    if (is_curved) write_curvature(w, set.contacts[i].curvature);
  }
  return w.ok() ? w.size() : 0;
}

Fault read(std::span<const std::byte> payload, ContactAnswer& out) noexcept {
  CheckedReader r(payload);
  const std::size_t block_bytes = r.raw().u16(), record_bytes = r.raw().u16(), count = r.raw().u16();
  ContactAnswer answer;
  answer.left_out = r.raw().u16();
  if (count > contact::kMaxContacts) return Fault::kRange;
  if (block_bytes < kContactBlockBytes || record_bytes < kContactRecordBytes) return Fault::kLength;
  if (payload.size() != block_bytes + count * record_bytes) return Fault::kLength;
  answer.times = r.times();
  contact::ContactSet& set = answer.set;
  set.pose_sequence = r.raw().u32();
  set.pose_time_ns = r.time();
  set.X_WT = r.pose();
  set.F_To_W.torque_Nm = r.vector_f32(kMaxForce);
  set.F_To_W.force_N = r.vector_f32(kMaxForce);
  set.pairs_near = r.raw().u32();
  set.count = static_cast<std::uint32_t>(count);
  if (block_bytes >= kContactBlockBytes + kLineBytes) answer.line = r.line();
  if (r.fault() != Fault::kNone) return r.fault();
  for (std::size_t i = 0; i < count; ++i) {
    const Fault fault = read_contact(payload.subspan(block_bytes + i * record_bytes, record_bytes), set.contacts[i]);
    if (fault != Fault::kNone) return fault;
  }
  out = answer;
  return Fault::kNone;
}

}  // namespace farfeel::codecs
