// The two short codes at the end of an initiation and a response, which cost a microsecond to check and so come first.
//
//   ... | mac1 16 B | mac2 16 B
//
// mac1 shows that the sender knows the receiver's public key: a key made of it, over all that stands before. It stops
// whoever scans the Internet at random. mac2 shows that the sender receives what is sent to its address: the cookie
// that was sent there as key (cookie.h), over all that stands before, mac1 included; zeros where no cookie is known.
// Both are BLAKE2b with a key and 16 bytes of output. All of it is realtime-safe.
#pragma once

#include "transport/seal/suite.h"

namespace farfeel::transport {

inline constexpr std::size_t kMacBytes = 16;
using Mac16 = std::array<std::byte, kMacBytes>;
using Cookie = Mac16;

/// BLAKE2b with a key of 16 to 64 bytes.
[[nodiscard]] Mac16 keyed_mac(std::span<const std::byte> key, std::span<const std::byte> message) noexcept;
/// BLAKE2b-256 with a key: a key that is made of another one.
[[nodiscard]] Key32 derived_key(const Key32& key, std::span<const std::byte> message) noexcept;
/// BLAKE2b-256 of an 8-letter label and a public key: a key that belongs to the label's use alone.
[[nodiscard]] Key32 labelled_key(std::span<const char, 8> label, const Key32& public_key) noexcept;

/// The key of mac1 in everything that is sent to the holder of public_key.
[[nodiscard]] Key32 mac1_key_of(const Key32& public_key) noexcept;

// In datagrams that end in the two codes. Precondition of each: datagram.size() >= 2 * kMacBytes.
[[nodiscard]] Mac16 mac1_in(std::span<const std::byte> datagram) noexcept;
void write_mac1(const Key32& mac1_key, std::span<std::byte> datagram) noexcept;  ///< and zeros as mac2
void write_mac2(const Cookie& cookie, std::span<std::byte> datagram) noexcept;   ///< after mac1
[[nodiscard]] bool is_mac1_right(const Key32& mac1_key, std::span<const std::byte> datagram) noexcept;
[[nodiscard]] bool is_mac2_right(const Cookie& cookie, std::span<const std::byte> datagram) noexcept;
[[nodiscard]] bool is_mac2_zero(std::span<const std::byte> datagram) noexcept;

}  // namespace farfeel::transport
