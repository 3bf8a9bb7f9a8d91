// The bulk lane's messages, as they stand in an opened datagram, from the type byte on. PROTOCOL.md has each
// one's table.
//
// A numbered message carries data: it begins with a bulk head and is acknowledged by a receipt. The others are
// statements ("here is an object", "these pieces are here"): they have no number, are said again until they are
// answered, and change nothing when they come twice.
//
// write() returns the message's bytes within `to`, or an empty span if they do not fit. read() fails on any other
// length than the layout's own and on values out of range. Neither allocates nor throws.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "transport/bulk/object.h"

namespace farfeel::transport {

enum class BulkType : std::uint8_t {
  kReceipt = 0x20,
  kObjectOffer = 0x21,
  kObjectAnswer = 0x22,
  kObjectWithdrawal = 0x23,
  kPadding = 0x28,  ///< numbered from here on
  kObjectPiece = 0x29,
  kTile = 0x2A,
  kCourse = 0x2B,
};
[[nodiscard]] constexpr bool is_numbered(std::uint8_t type) {
  return (type & 0xF8) == 0x28;
}
[[nodiscard]] constexpr bool is_of_bulk(std::uint8_t type) {
  return (type & 0xF0) == 0x20;
}

// Specification constants. A datagram is a message, sealed: 16 bytes before it and 16 behind.
inline constexpr std::size_t kSealedBytes = 32;
inline constexpr std::size_t kLargeDatagram = 1'232;  ///< fits every path that IPv6 allows
inline constexpr std::size_t kSmallDatagram = 1'200;  ///< where the large ones vanish
inline constexpr std::size_t kMostMessageBytes = kLargeDatagram - kSealedBytes;
using MessageBuffer = std::array<std::byte, kMostMessageBytes>;

/// Objects are counted in granules: pieces begin and, but for the last, end at their borders.
inline constexpr std::size_t kGranuleBytes = 16;
[[nodiscard]] constexpr std::uint32_t granules_of(std::uint64_t size) {
  return static_cast<std::uint32_t>((size + kGranuleBytes - 1) / kGranuleBytes);
}

/// What every numbered message begins with.
struct BulkHead {
  std::uint8_t type = 0;        ///< 0x28 .. 0x2F
  std::uint32_t number = 0;     ///< counts this end's numbered messages in the session, with gaps; wraps
  std::uint32_t t_send_us = 0;  ///< of the sender's clock; wraps
  std::uint8_t spacing = 1;     ///< least time between receipts that the sender asks for [250 us]
  static constexpr std::size_t kBytes = 10;
  static constexpr std::int64_t kSpacing_ns = 250'000;
};

/// Which numbers have arrived, and when. Ranges go from the newest number down.
struct Receipt {
  struct Range {
    std::uint16_t gap = 0;     ///< numbers missing above it; 0 in the first range only
    std::uint16_t length = 0;  ///< numbers in it, at least 1
  };
  /// When a datagram arrived that is not yet in an earlier receipt.
  struct Stamp {
    std::uint8_t back = 0;        ///< its number is newest - back; not 0
    std::int16_t earlier_us = 0;  ///< than the newest; negative if it was overtaken
  };
  static constexpr std::size_t kMostRanges = 32, kMostStamps = 16;

  std::uint32_t newest = 0;      ///< the greatest number that has arrived
  std::uint32_t echo_us = 0;     ///< its t_send_us
  std::uint32_t arrival_us = 0;  ///< when it arrived, of the receiver's clock; wraps
  std::uint32_t hold_us = 0;     ///< from then until this receipt left
  std::uint8_t ranges = 0, stamps = 0;
  std::array<Range, kMostRanges> range{};
  std::array<Stamp, kMostStamps> stamp{};
};

/// "Here is an object." A greater id in the same slot takes the place of a smaller one.
struct ObjectOffer {
  std::uint32_t id = 0;    ///< counts the sender's offers in the session, from 1
  std::uint32_t slot = 0;  ///< what the object is; its versions share it
  std::uint16_t ask = 0;   ///< counts the sayings of this offer; echoed
  std::uint64_t size = 0;  ///< 1 .. kMaxObjectBytes
  ObjectHash hash{};
};

enum class ObjectState : std::uint8_t { kReceiving = 0, kComplete = 1, kRefused = 2, kGone = 3 };
enum class RefusedBecause : std::uint8_t { kNothing = 0, kTooLarge = 1, kNoRoom = 2, kTooMany = 3, kCorrupt = 4 };

/// What the receiver has of an object. While it is kReceiving the ranges name granules that are here; there may be
/// more.
struct ObjectAnswer {
  struct Range {
    std::uint32_t begin = 0, end = 0;  ///< granules [begin, end)
  };
  static constexpr std::size_t kMostRanges = 128;

  std::uint32_t id = 0;
  std::uint32_t revision = 0;  ///< counts the receiver's answers in the session; of two, the greater holds
  std::uint16_t ask = 0;       ///< of the newest offer heard
  ObjectState state{};
  RefusedBecause reason{};  ///< kNothing unless state is kRefused
  std::uint8_t round = 0;   ///< how often it was complete and did not match its hash
  std::uint8_t ranges = 0;  ///< ascending and apart; none unless state is kReceiving
  std::array<Range, kMostRanges> range{};
};

/// "Forget this object." Answered kGone, whether the receiver knows it or not.
struct ObjectWithdrawal {
  std::uint32_t id = 0;
};

struct ObjectPiece {
  std::uint32_t id = 0;
  std::uint32_t granule = 0;  ///< its bytes stand at granule * kGranuleBytes
  std::span<const std::byte> bytes;
  static constexpr std::size_t kBytes = 8;  ///< before the bytes
};

[[nodiscard]] std::span<const std::byte> write(const BulkHead&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::span<const std::byte> write(const Receipt&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::span<const std::byte> write(const ObjectOffer&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::span<const std::byte> write(const ObjectAnswer&, std::span<std::byte> to) noexcept;
[[nodiscard]] std::span<const std::byte> write(const ObjectWithdrawal&, std::span<std::byte> to) noexcept;
/// What follows the head.
[[nodiscard]] std::span<const std::byte> write(const ObjectPiece&, std::span<std::byte> to) noexcept;

/// The head of a numbered message; what follows it is message.subspan(BulkHead::kBytes).
[[nodiscard]] std::optional<BulkHead> read_bulk_head(std::span<const std::byte> message) noexcept;
[[nodiscard]] std::optional<Receipt> read_receipt(std::span<const std::byte> message) noexcept;
[[nodiscard]] std::optional<ObjectOffer> read_object_offer(std::span<const std::byte> message) noexcept;
[[nodiscard]] std::optional<ObjectAnswer> read_object_answer(std::span<const std::byte> message) noexcept;
[[nodiscard]] std::optional<ObjectWithdrawal> read_object_withdrawal(std::span<const std::byte> message) noexcept;
[[nodiscard]] std::optional<ObjectPiece> read_object_piece(std::span<const std::byte> body) noexcept;

}  // namespace farfeel::transport
