#include "codecs/wire/haptic_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "codecs/wire/wire_fields.h"

namespace farfeel::codecs {
namespace {

using transport::ByteWriter;

void write_times(ByteWriter& w, const LinkTimes& times) {
  w.i64(times.t_send_ns);
  w.i64(times.t_echo_ns);
  w.u32(times.hold_us);
}

LinkTimes read_times(CheckedReader& r) {
  LinkTimes t;
  t.t_send_ns = r.time();
  t.t_echo_ns = r.time();
  t.hold_us = r.raw().u32();
  return t;
}

constexpr std::uint16_t kWishCurvature = 1, kWishWaves = 2, kWishPassivity = 4;

std::uint16_t wishes_of(const PoseSample& sample) {
  using teleoperation::Controller;
  const bool has_waves = sample.controller == Controller::kWaves,
             has_passivity = sample.controller == Controller::kPassivity;
  return static_cast<std::uint16_t>((sample.wants_curvature ? kWishCurvature : 0) | (has_waves ? kWishWaves : 0) |
                                    (has_passivity ? kWishPassivity : 0));
}

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
    c.curvature = r.curvature();
    if (r.fault() != Fault::kNone) return r.fault();
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
  sample.times = read_times(r);
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
  answer.times = read_times(r);
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
