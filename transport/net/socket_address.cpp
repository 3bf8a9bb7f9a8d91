#include "transport/net/socket_address.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>

namespace farfeel::transport {
namespace {

constexpr std::uint8_t kMappedPrefix[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};  // of ::ffff:a.b.c.d

}  // namespace

socklen_t to_sockaddr(const Address& address, sockaddr_storage& out, bool as_ipv6) noexcept {
  out = {};
  if (address.is_ipv6 || as_ipv6) {
    sockaddr_in6 in6{};
    in6.sin6_family = AF_INET6;
    in6.sin6_port = htons(address.port);
    in6.sin6_scope_id = address.scope_id;
    if (address.is_ipv6) {
      std::memcpy(&in6.sin6_addr, address.ip.data(), 16);
    } else {
      std::memcpy(&in6.sin6_addr, kMappedPrefix, 12);
      std::memcpy(in6.sin6_addr.s6_addr + 12, address.ip.data(), 4);
    }
    std::memcpy(&out, &in6, sizeof in6);
    return sizeof in6;
  }
  sockaddr_in in4{};
  in4.sin_family = AF_INET;
  in4.sin_port = htons(address.port);
  std::memcpy(&in4.sin_addr, address.ip.data(), 4);
  std::memcpy(&out, &in4, sizeof in4);
  return sizeof in4;
}

Address from_ipv6(const std::uint8_t* ip, std::uint16_t port, std::uint32_t scope_id) noexcept {
  Address address;
  address.port = port;
  if (std::equal(kMappedPrefix, kMappedPrefix + 12, ip)) {
    std::copy_n(ip + 12, 4, address.ip.begin());
    return address;
  }
  address.is_ipv6 = true;
  std::copy_n(ip, 16, address.ip.begin());
  if (address.is_link_local()) address.scope_id = scope_id;
  return address;
}

Address from_sockaddr(const sockaddr_storage& from) noexcept {
  Address address;
  if (from.ss_family == AF_INET6) {
    sockaddr_in6 in6{};
    std::memcpy(&in6, &from, sizeof in6);
    return from_ipv6(in6.sin6_addr.s6_addr, ntohs(in6.sin6_port), in6.sin6_scope_id);
  }
  if (from.ss_family == AF_INET) {
    sockaddr_in in4{};
    std::memcpy(&in4, &from, sizeof in4);
    std::memcpy(address.ip.data(), &in4.sin_addr, 4);
    address.port = ntohs(in4.sin_port);
  }
  return address;
}

}  // namespace farfeel::transport
