// The two payloads of the haptic lane: the tool's state up, the contacts down. transport/PROTOCOL.md has their tables.
//
// Each is absolute and complete: the newest wins, and a lost one costs nothing but freshness. Layouts are fixed and
// little-endian. Geometry that anchors other geometry (poses, contact points) is f64; what is relative to it is f32.
// Nothing here allocates, throws or locks: both ends call it from their real-time threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "codecs/wire/haptic_limits.h"
#include "haptic_core/contact/contact_set.h"
#include "haptic_core/spatial/spatial.h"
#include "haptic_core/teleoperation/controller.h"

namespace farfeel::codecs {

// Specification constants. Values outside are refused by the reader.
inline constexpr std::size_t kMaxHapticPayloadBytes = 1184;  ///< a 1200 B datagram less its header
inline constexpr std::size_t kPoseSampleBytes = 116;
inline constexpr std::size_t kLineBytes = 56;  ///< behind a pose sample, and in a contact set's block, where asked for
inline constexpr std::size_t kContactBlockBytes = 124;  ///< before the contact records
inline constexpr std::size_t kContactRecordBytes = 93;
inline constexpr std::size_t kMaxContactsPerDatagram =
    (kMaxHapticPayloadBytes - kContactBlockBytes) / kContactRecordBytes;          ///< 11
inline constexpr std::size_t kCurvatureBytes = 2 * contact::Curvature::kEntries;  ///< behind a record, where asked for
inline constexpr std::size_t kMaxCurvedContactsPerDatagram =
    (kMaxHapticPayloadBytes - kContactBlockBytes) / (kContactRecordBytes + kCurvatureBytes);  ///< 7
inline constexpr double kNormalTolerance = 1e-5;  ///< of an f32 unit vector's length

/// What both ends need to measure the round trip from any one datagram: now - t_echo - hold.
struct LinkTimes {
  std::int64_t t_send_ns = 0;  ///< sender's CLOCK_MONOTONIC
  std::int64_t t_echo_ns = 0;  ///< t_send of the newest datagram received from the other end; 0 before any
  std::uint32_t hold_us = 0;   ///< time from that one's arrival to this one's sending
};

struct PoseSample {
  std::uint32_t sequence = 0;  ///< the haptic loop's own count; comes back as ContactSet::pose_sequence
  std::int64_t time_ns = 0;    ///< scene time when the pose was sampled; comes back as ContactSet::pose_time_ns
  spatial::Pose X_WT;
  spatial::Twist V_WT_W;  ///< of T's origin
  LinkTimes times;
  bool wants_curvature = false;  ///< contacts are wanted with their depth's second derivative
  std::uint32_t ahead_us = 0;    ///< at the pose moved on with its twist for so long, <= kMostAhead_us
  /// kWaves, kPassivity: the slave simulates the tool, from the session's first pose on, and `line` moves it. On the
  /// wire kDirect is kOurs: contacts are all it needs.
  teleoperation::Controller controller = teleoperation::Controller::kOurs;
  teleoperation::LineValue line = {};
};

/// A ContactSet on its way.
struct ContactAnswer {
  contact::ContactSet set;
  LinkTimes times;
  std::uint16_t left_out = 0;  ///< contacts that did not fit: always the shallowest, or furthest apart
  std::optional<teleoperation::LineValue> line = {};  ///< where the slave simulates the tool, whose pose the set's is
};

/// Writes kPoseSampleBytes, and kLineBytes more where there is a line. Returns the bytes written, 0 if they do not fit.
[[nodiscard]] std::size_t write(const PoseSample&, std::span<std::byte> to) noexcept;
/// Exact length, finite, within range, unit quaternion; otherwise out is left as it was.
[[nodiscard]] Fault read(std::span<const std::byte> payload, PoseSample& out) noexcept;

/// How many of an answer's contacts go into one datagram: fewer where one has a curvature, because all then have room
/// for theirs, and fewer with a line.
[[nodiscard]] std::size_t contacts_that_fit(const ContactAnswer&) noexcept;
/// Writes as many contacts as fit in kMaxHapticPayloadBytes, the deepest first to be kept, in the set's order.
/// `left_out` of the argument is not looked at. Returns the bytes written, 0 if not even the block fits.
[[nodiscard]] std::size_t write(const ContactAnswer&, std::span<std::byte> to) noexcept;
/// As for PoseSample; normals are made unit in double again. Blocks and records longer than this version knows are
/// read up to what it knows; shorter ones are refused.
[[nodiscard]] Fault read(std::span<const std::byte> payload, ContactAnswer& out) noexcept;

}  // namespace farfeel::codecs
