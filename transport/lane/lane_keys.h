// What a finished handshake gives to the thread that owns a lane's socket, and the sizes of a lane's datagrams.
#pragma once

#include <cstddef>
#include <cstdint>

#include "transport/seal/handshake_messages.h"

namespace farfeel::transport {

// Specification constants: both ends must agree on these.
inline constexpr std::size_t kDataHeaderBytes = 16;      ///< type, zeros, receiver index, counter: authenticated
inline constexpr std::size_t kMaxDatagramBytes = 1'232;  ///< IPv6's least MTU of 1280 less its header and UDP's
inline constexpr std::size_t kSealBytes = kDataHeaderBytes + 1 + kTagBytes;  ///< all but the message, its type included
inline constexpr std::size_t kMaxMessageBytes = kMaxDatagramBytes - kSealBytes;
inline constexpr std::int64_t kKeyLife_ns = 180'000'000'000;  ///< no datagram is sealed or opened with older keys
inline constexpr std::int64_t kRekey_ns = 120'000'000'000;    ///< the initiator makes new ones after so long

/// One handshake's keys. The same numbers at both ends, `send` and `receive` exchanged.
struct LaneKeys {
  std::uint64_t generation = 0;  ///< counts this end's handshakes of this lane from 1: newer keys have a larger one
  Suite suite = Suite::kChaChaPoly;
  std::uint32_t local_index = 0;   ///< in datagrams that come
  std::uint32_t remote_index = 0;  ///< in datagrams that go
  Key32 send{}, receive{};
  std::int64_t made_ns = 0;   ///< this end's CLOCK_MONOTONIC
  std::uint64_t epoch = 0;    ///< of the slave: another one at each of its starts
  std::uint32_t session = 0;  ///< that the lane belongs to
};

/// A random index that is not 0. Its lowest bit is 0 for the haptic lane alone.
[[nodiscard]] std::uint32_t new_local_index(LaneKind);

/// What a process calls itself, so that its peer notices a restart, and any number not to be guessed: random, never 0.
[[nodiscard]] std::uint64_t random_identity();
/// A session's number: random, never 0.
[[nodiscard]] std::uint32_t random_session();

}  // namespace farfeel::transport
