// The tool's state, up: 64 bytes with the felt wrench, 52 without. transport/PROTOCOL.md has the table.
//
// Each is absolute and complete: the newest wins, and a lost one costs nothing but freshness. The master remembers what
// it told under which number, so that an answer need not say which pose it is about.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codecs/wire/haptic_limits.h"
#include "codecs/wire/pose_grid.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/teleoperation/controller.h"

namespace farfeel::codecs {

inline constexpr std::size_t kPoseMessageBytes = 52;  ///< on the grid, without what is optional
inline constexpr std::size_t kWrenchBytes = 12;
inline constexpr std::size_t kAheadBytes = 2;
inline constexpr std::size_t kLineValueBytes = 56;
/// Poses that the master remembers: 2 s of them at 2 kHz. Answers that are so old are expired anyway.
inline constexpr std::uint32_t kPosesRemembered = 4096;
inline constexpr std::uint64_t kMaxSceneTime_us = (std::uint64_t{1} << 48) - 1;  ///< 8.9 years
inline constexpr std::uint16_t kLongHold = 0xFFFF;

/// From any one datagram either end has the round trip: now - t_echo - hold, in microseconds modulo 2^32. Each end's
/// clock is its own.
struct LaneTimes {
  std::uint32_t t_send_us = 0;  ///< when this one was sent
  std::uint32_t t_echo_us = 0;  ///< t_send of the newest datagram from the other end
  /// In a pose from that one's arrival to this one's sending; in an answer from when the slave began to compute it:
  /// what a pose waited before is part of the round trip. kLongHold: longer, or none yet.
  std::uint16_t hold_us = kLongHold;
  friend bool operator==(const LaneTimes&, const LaneTimes&) = default;
};

/// Of a datagram that is sent now, whose hold began at held_since_ns; times of this end's clock.
[[nodiscard]] LaneTimes times_now(std::uint32_t t_echo_us, std::int64_t held_since_ns, std::int64_t now_ns) noexcept;
/// Of a datagram that arrived at arrival_ns, the other end's hold taken out; nothing where it echoes none, or too old a
/// one.
[[nodiscard]] std::optional<std::int64_t> round_trip_ns(const LaneTimes&, std::int64_t arrival_ns) noexcept;

struct PoseMessage {
  std::uint32_t number = 0;    ///< of the message, by which answers name it; PoseWriter counts, from 1 on
  std::uint32_t sequence = 0;  ///< the haptic loop's own, remembered and not told
  std::int64_t time_us = 0;    ///< scene time when the pose was sampled, 0 to kMaxSceneTime_us
  spatial::Pose X_WT;
  spatial::Twist V_WT_W;  ///< of T's origin; told in halves
  LaneTimes times;
  std::optional<std::uint16_t> heard;        ///< AnswerReader::heard
  std::optional<spatial::Wrench> felt_To_W;  ///< what the operator feels of the contacts; told in halves
  bool wants_curvature = false;              ///< contacts are wanted with their depth's second derivative,
  std::uint32_t ahead_us = 0;                ///< at the pose moved on with its twist for so long, <= kMostAhead_us
  /// Told where it moves a tool that the slave simulates, from the session's first pose on. On the wire kDirect is
  /// kOurs: contacts are all it needs.
  teleoperation::LineValue line = {};
};

/// A pose as both ends have it.
struct SentPose {
  std::uint32_t number = 0;  ///< 0: none
  std::uint32_t sequence = 0;
  std::int64_t time_us = 0;
  spatial::Pose X_WT;
};

/// The master's end. One thread; takes memory when it is made and nowhere else.
class PoseWriter {
 public:
  PoseWriter() : sent_(kPosesRemembered) {}

  /// A session begins: what was sent before is forgotten. Numbers go on, so that none is ever used twice.
  void reset(const PoseGrid& grid) noexcept;
  /// Gives the message the next number and remembers it. Returns the bytes written; 0 if they do not fit, and then
  /// nothing has happened.
  [[nodiscard]] std::size_t write(const PoseMessage&, std::span<std::byte> to) noexcept;
  /// Null where it was not sent since reset(), or so long ago that it is forgotten.
  [[nodiscard]] const SentPose* find(std::uint32_t number) const noexcept;
  [[nodiscard]] const PoseGrid& grid() const noexcept { return grid_; }

 private:
  PoseGrid grid_;
  std::uint32_t number_ = 0;
  std::vector<SentPose> sent_;  // at number % kPosesRemembered
};

/// The slave's end: exact length, finite, within range; otherwise out is left as it was. Which of several is the newest
/// is the caller's business. Realtime-safe.
[[nodiscard]] Fault read(std::span<const std::byte> message, const PoseGrid&, PoseMessage& out) noexcept;

// Of both directions' messages.
void write_times(transport::ByteWriter&, const LaneTimes&) noexcept;
[[nodiscard]] LaneTimes read_times(transport::ByteReader&) noexcept;
/// Six halves: angular, or the torque, first. What is greater than a half may be is told as the greatest.
void write_halves(transport::ByteWriter&, const spatial::Vector6&) noexcept;
[[nodiscard]] spatial::Vector6 read_halves(CheckedReader&, double most) noexcept;

}  // namespace farfeel::codecs
