// Addresses as the system's calls take them.
#pragma once

#include <sys/socket.h>

#include "transport/net/address.h"

namespace farfeel::transport {

/// With as_ipv6, an IPv4 address becomes ::ffff:a.b.c.d, which an IPv6 socket that also serves IPv4 wants. Returns the
/// size. Realtime-safe.
socklen_t to_sockaddr(const Address&, sockaddr_storage& out, bool as_ipv6 = false) noexcept;
/// AF_INET or AF_INET6; ::ffff:a.b.c.d becomes IPv4. Anything else is 0.0.0.0 with port 0. Realtime-safe.
[[nodiscard]] Address from_sockaddr(const sockaddr_storage&) noexcept;
/// 16 bytes of an IPv6 address, with the scope kept only where it means something.
[[nodiscard]] Address from_ipv6(const std::uint8_t* ip, std::uint16_t port, std::uint32_t scope_id) noexcept;

}  // namespace farfeel::transport
