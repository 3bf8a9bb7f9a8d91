// Datagrams as they travel between the sockets and whoever reads them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "transport/net/address.h"

namespace farfeel::transport {

/// The longest UDP payload in use: IPv6's least MTU, 1280, less 40 B of IPv6 and 8 B of UDP header.
inline constexpr std::size_t kMostDatagramBytes = 1232;

/// How a network may treat a datagram: the upper six bits of IPv4's TOS and IPv6's traffic class.
enum class Dscp : std::uint8_t {
  kBestEffort = 0,
  kLowerEffort = 1,        ///< LE, RFC 8622: bulk, which gives way to everything else
  kNotQueueBuilding = 45,  ///< NQB of the IETF: a shallow queue where EF is not to be had
  kExpedited = 46,         ///< EF, RFC 3246: the haptic lane and its keep-alive
};

/// The lower two bits, RFC 3168.
enum class Ecn : std::uint8_t { kNotCapable = 0, kCapable1 = 1, kCapable0 = 2, kCongestion = 3 };

/// A datagram as it was received.
struct Received {
  std::span<const std::byte> bytes;  ///< into the caller's buffer
  Address from;
  Address to;  ///< the local address that it was sent to, with the port; never 0.0.0.0 or ::
  /// CLOCK_MONOTONIC at its arrival in the kernel, or when it was read. Of the machine's first socket that asks for
  /// arrivals, the first few may be times of reading all the same: the kernel takes a moment to begin.
  std::int64_t time_ns = 0;
  bool time_is_of_arrival = true;  ///< false: the kernel's stamp was missing or could not be trusted; it was read then
  bool has_marking = false;        ///< whether the kernel told dscp and ecn
  std::uint8_t dscp = 0;           ///< as it arrived: another one than was sent means that the network changed it
  Ecn ecn = Ecn::kNotCapable;
};

/// A copy of a datagram that owns its bytes: a slot of the queues between threads.
struct RawDatagram {
  Received received;  ///< its bytes are unset: see view()
  std::uint16_t size = 0;
  std::array<std::byte, kMostDatagramBytes> bytes;

  RawDatagram() = default;
  /// Copies at most kMostDatagramBytes.
  explicit RawDatagram(const Received& other) noexcept : received(other) {
    size = static_cast<std::uint16_t>(std::min(other.bytes.size(), bytes.size()));
    std::copy_n(other.bytes.begin(), size, bytes.begin());
    received.bytes = {};
  }
  RawDatagram(const RawDatagram& other) noexcept { *this = other; }
  RawDatagram& operator=(const RawDatagram& other) noexcept {
    received = other.received;
    size = other.size;
    std::copy_n(other.bytes.begin(), size, bytes.begin());
    return *this;
  }
};

}  // namespace farfeel::transport
