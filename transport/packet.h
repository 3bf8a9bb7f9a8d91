// The 16 bytes every datagram begins with. PROTOCOL.md is the specification; this is the code for its first table.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {

/// Where a slave listens unless told otherwise: the haptic lane here, the bulk lane on the next port.
inline constexpr std::uint16_t kDefaultPort = 47000;

// Specification constants: both ends must agree on these.
inline constexpr std::uint16_t kMagic = 0x4646;         ///< "FF"
inline constexpr std::uint8_t kVersion = 1;             ///< of everything in PROTOCOL.md
inline constexpr std::size_t kHeaderBytes = 16;         ///< before every payload
inline constexpr std::size_t kMaxDatagramBytes = 1200;  ///< fits every path that IPv6 allows, with room for sealing
inline constexpr std::size_t kMaxPayloadBytes = kMaxDatagramBytes - kHeaderBytes;

/// What a datagram carries, and by that its lane and direction.
enum class PacketType : std::uint8_t {
  kHello = 1,             ///< bulk lane, master -> slave
  kWelcome = 2,           ///< bulk lane, slave -> master
  kRefusal = 3,           ///< bulk lane, slave -> master
  kBye = 4,               ///< bulk lane, either way
  kKeepAlive = 5,         ///< bulk lane, master -> slave
  kOffer = 6,             ///< bulk lane, slave -> master: an object stands ready
  kChunk = 7,             ///< bulk lane, slave -> master: a piece of it
  kAcknowledge = 8,       ///< bulk lane, master -> slave: which pieces arrived
  kSlaveStatus = 9,       ///< bulk lane, slave -> master
  kTile = 10,             ///< bulk lane, slave -> master: a part of a height tile
  kTileAcknowledge = 11,  ///< bulk lane, master -> slave: which tiles are whole
  kPoseSample = 16,       ///< haptic lane, master -> slave
  kContactSet = 17,       ///< haptic lane, slave -> master
};

struct Header {
  PacketType type{};
  std::uint32_t session = 0;   ///< chosen by the slave, never 0 in a session; 0 before there is one
  std::uint32_t sequence = 0;  ///< of this lane in this direction, 1 for a session's first datagram
};

enum class HeaderFault : std::uint8_t { kNone, kNotOurs, kOtherVersion, kLength, kUnknownType };

/// The header and the payload that follows it, which points into the datagram.
struct Packet {
  Header header;
  std::span<const std::byte> payload;
  HeaderFault fault = HeaderFault::kNone;  ///< anything but kNone: do not look at the rest

  [[nodiscard]] bool ok() const noexcept { return fault == HeaderFault::kNone; }
};

/// Writes header, then payload. Returns the datagram's size, or 0 if it would exceed to's size or kMaxDatagramBytes.
/// to must not overlap payload, unless payload stands already at to[kHeaderBytes]. Realtime-safe.
[[nodiscard]] std::size_t write_packet(const Header&, std::span<const std::byte> payload,
                                       std::span<std::byte> to) noexcept;
/// Checks magic, version, length against the datagram's own size, the zero bytes and the type. Realtime-safe.
[[nodiscard]] Packet read_packet(std::span<const std::byte> datagram) noexcept;

[[nodiscard]] std::string_view name_of(PacketType) noexcept;

}  // namespace farfeel::transport
