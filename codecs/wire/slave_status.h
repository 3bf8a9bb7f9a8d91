// What the slave says of itself a few times a second: how fast it answers, and what reached it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "codecs/wire/haptic_limits.h"

namespace farfeel::codecs {

/// Absolute, over the live session; the newest wins. The payload of MessageType::kSlaveStatus.
struct SlaveStatus {
  double contact_hz = 0;  ///< answers per second, from the session's first to its last so far
  double contact_us_p50 = 0, contact_us_p99 = 0, contact_us_max = 0;  ///< of answering one pose
  double waiting_us_p50 = 0, waiting_us_p99 = 0, waiting_us_max = 0;  ///< of a pose, from its arrival until then
  // Pose samples at the slave: what the master's `up` counters are, less its own count of those sent.
  std::uint64_t poses_received = 0, poses_lost = 0, poses_late = 0, poses_duplicate = 0;
  std::uint64_t poses_malformed = 0;    ///< authentic, with a payload that was refused
  std::uint64_t contacts_sent = 0;      ///< contact sets sent
  std::uint64_t contacts_left_out = 0;  ///< single contacts that did not fit in their datagram
};

inline constexpr std::size_t kSlaveStatusBytes = 84;

[[nodiscard]] std::size_t write(const SlaveStatus&, std::span<std::byte> to) noexcept;
[[nodiscard]] Fault read(std::span<const std::byte> payload, SlaveStatus& out) noexcept;

}  // namespace farfeel::codecs
