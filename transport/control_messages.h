// The payloads of the bulk lane that set a session up and move objects. PROTOCOL.md has each one's table.
//
// There is no stream: every message states something whole ("here is an object", "these pieces arrived") and is said
// again until its answer comes, so a lost or repeated one changes nothing.
//
// write() returns the payload's bytes within `to`; read() fails on any other length than the layout's own and on values
// out of range. Neither allocates nor throws.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "transport/lane/lane_keys.h"
#include "transport/message.h"
#include "transport/object.h"

namespace farfeel::transport {

using PayloadBuffer = std::array<std::byte, kMaxMessageBytes>;

enum class ByeReason : std::uint8_t { kDone = 1, kRevoked = 2 };
struct Bye {
  ByeReason reason{};
};

struct Offer {
  std::uint32_t object = 0;  ///< counts the slave's offers in this session
  std::uint64_t size = 0;    ///< 1 .. kMaxObjectBytes
  ObjectHash hash{};
};

struct Chunk {
  std::uint32_t object = 0;
  std::uint32_t index = 0;     ///< its bytes stand at index * kChunkBytes
  std::int64_t t_send_ns = 0;  ///< slave's clock; echoed
  std::span<const std::byte> bytes;
};

/// Which chunks have arrived: all below `complete`, and those in the ranges.
struct Acknowledge {
  struct Range {
    std::uint32_t begin = 0, end = 0;  ///< [begin, end)
  };
  static constexpr std::size_t kMaxRanges = 64;

  std::uint32_t object = 0;
  std::uint32_t complete = 0;
  std::int64_t t_echo_ns = 0;  ///< t_send of the newest chunk received; 0 before any
  std::uint32_t hold_us = 0;   ///< how long that chunk had been here
  std::uint32_t ranges = 0;    ///< of the array below; ascending, apart, beyond `complete`
  std::array<Range, kMaxRanges> range{};
};

[[nodiscard]] std::span<const std::byte> write(const Bye&, PayloadBuffer& to) noexcept;
[[nodiscard]] std::span<const std::byte> write(const Offer&, PayloadBuffer& to) noexcept;
[[nodiscard]] std::span<const std::byte> write(const Chunk&, PayloadBuffer& to) noexcept;
[[nodiscard]] std::span<const std::byte> write(const Acknowledge&, PayloadBuffer& to) noexcept;

[[nodiscard]] std::optional<Bye> read_bye(std::span<const std::byte> payload) noexcept;
[[nodiscard]] std::optional<Offer> read_offer(std::span<const std::byte> payload) noexcept;
[[nodiscard]] std::optional<Chunk> read_chunk(std::span<const std::byte> payload) noexcept;
[[nodiscard]] std::optional<Acknowledge> read_acknowledge(std::span<const std::byte> payload) noexcept;

}  // namespace farfeel::transport
