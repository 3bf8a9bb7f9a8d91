#include "transport/net/address.h"

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>

#include <algorithm>
#include <charconv>

#include "transport/net/host_port.h"

namespace farfeel::transport {
namespace {

tl::unexpected<Error> unreadable(const std::string& text, const std::string& why, const std::string& advice) {
  return tl::unexpected(Error{ErrorKind::kAddress, "cannot read address '" + text + "': " + why + ". " + advice + "."});
}

std::string interface_names() {
  std::string names;
  if (struct if_nameindex* const interfaces = if_nameindex()) {
    for (const struct if_nameindex* i = interfaces; i->if_index != 0; ++i)
      names += (names.empty() ? "" : ", ") + std::string(i->if_name);
    if_freenameindex(interfaces);
  }
  return names.empty() ? "none" : names;
}

std::optional<std::uint32_t> scope_of(const std::string& interface) {
  if (const unsigned index = if_nametoindex(interface.c_str())) return index;
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(interface.data(), interface.data() + interface.size(), number);
  if (error != std::errc{} || end != interface.data() + interface.size() || number == 0) return std::nullopt;
  return number;
}

}  // namespace

Address Address::with_port(std::uint16_t other) const noexcept {
  Address copy = *this;
  copy.port = other;
  return copy;
}

bool Address::is_loopback() const noexcept {
  return is_ipv6 ? ip == loopback(true).ip : ip[0] == 127;
}

bool Address::is_any() const noexcept {
  return std::all_of(ip.begin(), ip.end(), [](std::uint8_t byte) { return byte == 0; });
}

bool Address::is_link_local() const noexcept {
  return is_ipv6 && ip[0] == 0xFE && (ip[1] & 0xC0) == 0x80;
}

AddressBytes to_bytes(const Address& address) noexcept {
  AddressBytes bytes{};
  bytes[0] = std::byte{address.is_ipv6 ? std::uint8_t{6} : std::uint8_t{4}};
  for (std::size_t i = 0; i < 16; ++i) bytes[1 + i] = std::byte{address.ip[i]};
  for (std::size_t i = 0; i < 2; ++i) bytes[17 + i] = static_cast<std::byte>(address.port >> (8 * i));
  for (std::size_t i = 0; i < 4; ++i) bytes[19 + i] = static_cast<std::byte>(address.scope_id >> (8 * i));
  return bytes;
}

Address loopback(bool is_ipv6) noexcept {
  Address address;
  address.is_ipv6 = is_ipv6;
  if (is_ipv6) {
    address.ip[15] = 1;
  } else {
    address.ip[0] = 127;
    address.ip[3] = 1;
  }
  return address;
}

Address any_address(bool is_ipv6) noexcept {
  Address address;
  address.is_ipv6 = is_ipv6;
  return address;
}

std::string to_string(const Address& address) {
  char text[INET6_ADDRSTRLEN] = "";
  inet_ntop(address.is_ipv6 ? AF_INET6 : AF_INET, address.ip.data(), text, sizeof text);
  const std::string port = std::to_string(address.port);
  if (!address.is_ipv6) return std::string(text) + ":" + port;
  std::string scope;
  if (address.scope_id != 0) {
    char name[IF_NAMESIZE] = "";
    scope = if_indextoname(address.scope_id, name) != nullptr ? name : std::to_string(address.scope_id);
    scope.insert(scope.begin(), '%');
  }
  return "[" + std::string(text) + scope + "]:" + port;
}

tl::expected<HostPort, Error> split_host_port(const std::string& text, std::optional<std::uint16_t> default_port) {
  const char* const advice = "Write 127.0.0.1:4000, [2001:db8::1]:4000 or name.example:4000";
  std::string host = text, port_text;
  bool has_port = false;
  if (!text.empty() && text.front() == '[') {
    const auto close = text.find(']');
    if (close == std::string::npos) return unreadable(text, "the bracket is not closed", advice);
    host = text.substr(1, close - 1);
    if (close + 1 < text.size()) {
      if (text[close + 1] != ':') return unreadable(text, "expected ':' after the bracket", advice);
      port_text = text.substr(close + 2);
      has_port = true;
    }
  } else if (const auto colon = text.rfind(':'); colon != std::string::npos && text.find(':') == colon) {
    host = text.substr(0, colon);
    port_text = text.substr(colon + 1);
    has_port = true;
  }
  if (host.empty()) return unreadable(text, "there is no host", advice);
  if (!has_port) {
    if (!default_port) return unreadable(text, "there is no port", advice);
    return HostPort{host, *default_port};
  }
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(port_text.data(), port_text.data() + port_text.size(), port);
  if (port_text.empty()) return unreadable(text, "there is no port after ':'", advice);
  if (error != std::errc{} || end != port_text.data() + port_text.size())
    return unreadable(text, "'" + port_text + "' is not a port (0 to 65535)", advice);
  return HostPort{host, port};
}

tl::expected<std::optional<Address>, Error> numeric_address(const std::string& text, const HostPort& at) {
  Address address;
  address.port = at.port;
  if (inet_pton(AF_INET, at.host.c_str(), address.ip.data()) == 1) return address;
  if (at.host.find_first_not_of("0123456789.") == std::string::npos)
    return unreadable(text, "'" + at.host + "' is not a whole IPv4 address", "Write four numbers, as 192.0.2.1:4000");
  const auto percent = at.host.find('%');
  in6_addr in6{};
  if (inet_pton(AF_INET6, at.host.substr(0, percent).c_str(), &in6) != 1) return std::nullopt;
  address.is_ipv6 = true;
  std::copy_n(in6.s6_addr, 16, address.ip.begin());
  if (IN6_IS_ADDR_V4MAPPED(&in6))
    return unreadable(text, "an IPv4 address is written in IPv6's form", "Write it in its own form, as 192.0.2.1:4000");
  if (percent == std::string::npos) {
    if (address.is_link_local())
      return unreadable(text, "a link-local address means nothing without an interface",
                        "Add one, as [fe80::1%eth0]:4000; this machine has " + interface_names());
    return address;
  }
  const std::string interface = at.host.substr(percent + 1);
  if (!address.is_link_local())
    return unreadable(text, "only a link-local address (fe80::...) has an interface", "Leave '%" + interface + "' out");
  const auto scope = scope_of(interface);
  if (!scope)
    return unreadable(text, "there is no interface '" + interface + "'", "This machine has " + interface_names());
  address.scope_id = *scope;
  return address;
}

tl::expected<Address, Error> parse_address(const std::string& text, std::optional<std::uint16_t> default_port) {
  const auto at = split_host_port(text, default_port);
  if (!at) return tl::unexpected(at.error());
  const auto address = numeric_address(text, *at);
  if (!address) return tl::unexpected(address.error());
  if (!*address)
    return unreadable(text, "'" + at->host + "' is not a numeric IPv4 or IPv6 address",
                      "Write 127.0.0.1:4000 or [2001:db8::1]:4000");
  return **address;
}

}  // namespace farfeel::transport
