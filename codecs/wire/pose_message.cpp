#include "codecs/wire/pose_message.h"

#include <algorithm>

#include "codecs/wire/quantised.h"

namespace farfeel::codecs {
namespace {

using teleoperation::Controller;
using transport::ByteReader;
using transport::ByteWriter;

enum Flag : std::uint8_t {
  kHasHeard = 1 << 0,
  kFullPosition = 1 << 1,
  kHasWrench = 1 << 2,
  kWantsCurvature = 1 << 3,
  kByWaves = 1 << 4,
  kByPassivity = 1 << 5
};

std::uint8_t flags_of(const PoseMessage& m, bool is_in_full) {
  return static_cast<std::uint8_t>((m.heard ? kHasHeard : 0) | (is_in_full ? kFullPosition : 0) |
                                   (m.felt_To_W ? kHasWrench : 0) | (m.wants_curvature ? kWantsCurvature : 0) |
                                   (m.line.by == Controller::kWaves ? kByWaves : 0) |
                                   (m.line.by == Controller::kPassivity ? kByPassivity : 0));
}

}  // namespace

void write_times(ByteWriter& w, const LaneTimes& times) noexcept {
  w.u32(times.t_send_us);
  w.u32(times.t_echo_us);
  w.u16(times.hold_us);
}

LaneTimes read_times(ByteReader& r) noexcept {
  LaneTimes times;
  times.t_send_us = r.u32();
  times.t_echo_us = r.u32();
  times.hold_us = r.u16();
  return times;
}

void write_halves(ByteWriter& w, const spatial::Vector6& v) noexcept {
  for (int i = 0; i < 6; ++i) w.u16(half_of(std::clamp(v[i], -kMostHalf, kMostHalf)));
}

spatial::Vector6 read_halves(CheckedReader& r, double most) noexcept {
  spatial::Vector6 v;
  for (int i = 0; i < 6; ++i) v[i] = r.checked(from_half(r.raw().u16()), -most, most);
  return v;
}

LaneTimes times_now(std::uint32_t t_echo_us, std::int64_t held_since_ns, std::int64_t now_ns) noexcept {
  const std::int64_t hold_us = std::max<std::int64_t>(0, now_ns - held_since_ns + 500) / 1000;
  return {static_cast<std::uint32_t>(now_ns / 1000), t_echo_us,
          static_cast<std::uint16_t>(std::min<std::int64_t>(hold_us, kLongHold))};
}

std::optional<std::int64_t> round_trip_ns(const LaneTimes& times, std::int64_t arrival_ns) noexcept {
  if (times.hold_us == kLongHold) return std::nullopt;
  const auto since_us = static_cast<std::int32_t>(static_cast<std::uint32_t>(arrival_ns / 1000) - times.t_echo_us);
  constexpr std::int32_t kMost_us = 60'000'000;
  if (since_us > kMost_us) return std::nullopt;
  // Holds are rounded to microseconds and arrivals come from another clock: a hair below zero is zero.
  return 1000 * std::max<std::int64_t>(0, std::int64_t{since_us} - times.hold_us);
}

void PoseWriter::reset(const PoseGrid& grid) noexcept {
  grid_ = grid;
  for (SentPose& pose : sent_) pose.number = 0;
}

const SentPose* PoseWriter::find(std::uint32_t number) const noexcept {
  const SentPose& pose = sent_[number % kPosesRemembered];
  return number != 0 && pose.number == number ? &pose : nullptr;
}

std::size_t PoseWriter::write(const PoseMessage& m, std::span<std::byte> to) noexcept {
  const ToldPose pose = told(m.X_WT, grid_);
  const std::uint32_t number = number_ + 1 != 0 ? number_ + 1 : 1;
  const auto time_us =
      static_cast<std::uint64_t>(std::clamp<std::int64_t>(m.time_us, 0, static_cast<std::int64_t>(kMaxSceneTime_us)));
  const std::uint8_t flags = flags_of(m, !pose.steps);
  ByteWriter w(to);
  w.u8(flags);
  w.u32(number);
  w.u32(static_cast<std::uint32_t>(time_us));
  w.u16(static_cast<std::uint16_t>(time_us >> 32));
  write_times(w, m.times);
  w.u16(m.heard.value_or(0));
  write_told(w, pose);
  write_halves(w, spatial::to_vector6(m.V_WT_W));
  if (m.felt_To_W) write_halves(w, spatial::to_vector6(*m.felt_To_W));
  if (m.wants_curvature) w.u16(static_cast<std::uint16_t>(std::min(m.ahead_us, kMostAhead_us)));
  if ((flags & (kByWaves | kByPassivity)) != 0) write_line(w, m.line);
  if (!w.ok()) return 0;
  number_ = number;
  sent_[number % kPosesRemembered] = {number, m.sequence, static_cast<std::int64_t>(time_us), from_told(pose, grid_)};
  return w.size();
}

Fault read(std::span<const std::byte> message, const PoseGrid& grid, PoseMessage& out) noexcept {
  CheckedReader r(message);
  PoseMessage m;
  const std::uint8_t flags = r.raw().u8();
  m.number = r.raw().u32();
  const std::uint64_t time_low_us = r.raw().u32(), time_high_us = r.raw().u16();
  m.time_us = static_cast<std::int64_t>(time_low_us | time_high_us << 32);
  m.times = read_times(r.raw());
  const std::uint16_t heard = r.raw().u16();
  if ((flags & kHasHeard) != 0) m.heard = heard;
  m.X_WT = read_told(r, (flags & kFullPosition) != 0, grid);
  m.V_WT_W = spatial::twist_from(read_halves(r, kMaxSpeed));
  if ((flags & kHasWrench) != 0) m.felt_To_W = spatial::wrench_from(read_halves(r, kMaxForce));
  m.wants_curvature = (flags & kWantsCurvature) != 0;
  if (m.wants_curvature) m.ahead_us = r.raw().u16();
  if ((flags & (kByWaves | kByPassivity)) != 0) {
    m.line = r.line();
    m.line.by = (flags & kByWaves) != 0 ? Controller::kWaves : Controller::kPassivity;
  }
  if (flags != flags_of(m, (flags & kFullPosition) != 0)) r.refuse();
  if (m.number == 0 || m.ahead_us > kMostAhead_us || (heard != 0 && !m.heard)) r.refuse();
  if (!r.raw().is_at_end()) return Fault::kLength;
  if (r.fault() != Fault::kNone) return r.fault();
  out = m;
  return Fault::kNone;
}

}  // namespace farfeel::codecs
