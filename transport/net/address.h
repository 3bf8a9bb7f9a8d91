// Where datagrams go: IPv4 and IPv6 addresses with a port, from text, from names.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "transport/error.h"

namespace farfeel::transport {

/// An IPv4 or IPv6 address with a port. A plain value: compares and copies. An IPv4 address that arrived at an IPv6
/// socket (::ffff:a.b.c.d) is kept as IPv4, so that one machine has one value.
struct Address {
  bool is_ipv6 = false;
  std::array<std::uint8_t, 16> ip{};  ///< network order; the first 4 bytes for IPv4, the others zero
  std::uint16_t port = 0;
  std::uint32_t scope_id = 0;  ///< interface index of a link-local IPv6 address; 0 for every other one

  [[nodiscard]] Address with_port(std::uint16_t other) const noexcept;
  [[nodiscard]] bool has_ip_of(const Address& other) const noexcept { return with_port(0) == other.with_port(0); }
  [[nodiscard]] bool is_loopback() const noexcept;    ///< 127.0.0.0/8 or ::1
  [[nodiscard]] bool is_any() const noexcept;         ///< 0.0.0.0 or ::, which stand for every address of this machine
  [[nodiscard]] bool is_link_local() const noexcept;  ///< fe80::/10, which means nothing without scope_id
  friend bool operator==(const Address&, const Address&) = default;
};

/// Family, ip, port and scope, as a cookie covers them. Two addresses have equal bytes if they are equal.
using AddressBytes = std::array<std::byte, 23>;
[[nodiscard]] AddressBytes to_bytes(const Address&) noexcept;

[[nodiscard]] Address loopback(bool is_ipv6 = false) noexcept;     ///< 127.0.0.1 or ::1, port 0
[[nodiscard]] Address any_address(bool is_ipv6 = false) noexcept;  ///< 0.0.0.0 or ::, port 0

/// "127.0.0.1:4000", "[::1]:4000" or "[fe80::1%eth0]:4000". Asks the kernel for the interface's name: not for real-time
/// threads.
[[nodiscard]] std::string to_string(const Address&);

/// What IP and UDP add to a datagram on its way there [bytes].
[[nodiscard]] constexpr std::size_t overhead_to(const Address& address) {
  constexpr std::size_t kIpv4 = 20, kIpv6 = 40, kUdp = 8;
  return kUdp + (address.is_ipv6 ? kIpv6 : kIpv4);
}

/// Reads what to_string writes, or a bare IPv4 or IPv6 address, then with default_port. No name is looked up.
/// Fails (kAddress) on anything else, on an interface that does not exist, and on a link-local address without one.
[[nodiscard]] tl::expected<Address, Error> parse_address(const std::string& text,
                                                         std::optional<std::uint16_t> default_port = {});

/// Addresses that the text may mean, at least one, at most kMostAddresses, without repeats: what parse_address reads,
/// or "HOST:PORT", "HOST" by the system's resolver. IPv6 and IPv4 take turns, each in the order that the system
/// prefers, so that whoever tries them one after another soon tries both. "localhost" is 127.0.0.1 and ::1, whatever
/// the resolver says. Blocks, for many seconds where no name server answers: not for threads that others wait for.
[[nodiscard]] tl::expected<std::vector<Address>, Error> resolve(const std::string& text,
                                                                std::optional<std::uint16_t> default_port = {});
inline constexpr std::size_t kMostAddresses = 8;

}  // namespace farfeel::transport
