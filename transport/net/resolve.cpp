#include <netdb.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "transport/net/address.h"
#include "transport/net/host_port.h"
#include "transport/net/socket_address.h"

namespace farfeel::transport {
namespace {

std::string advice_for(int code) {
  switch (code) {
    case EAI_AGAIN:
      return "No name server answered: check this machine's network, or write the numeric address";
    case EAI_NONAME:
    case EAI_NODATA:
      return "Check the spelling, or write the numeric address";
    default:
      return "Write the numeric address";
  }
}

int look_up(const std::string& host, int flags, addrinfo*& found) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = flags;
  return getaddrinfo(host.c_str(), nullptr, &hints, &found);
}

// Families take turns, beginning with the family of the first; within each the order stays.
std::vector<Address> interleaved(const std::vector<Address>& found) {
  std::vector<Address> first, second, result;
  for (const Address& address : found) (address.is_ipv6 == found.front().is_ipv6 ? first : second).push_back(address);
  for (std::size_t i = 0; i < std::max(first.size(), second.size()); ++i) {
    if (i < first.size()) result.push_back(first[i]);
    if (i < second.size()) result.push_back(second[i]);
  }
  result.resize(std::min(result.size(), kMostAddresses));
  return result;
}

}  // namespace

tl::expected<std::vector<Address>, Error> resolve(const std::string& text, std::optional<std::uint16_t> default_port) {
  const auto at = split_host_port(text, default_port);
  if (!at) return tl::unexpected(at.error());
  if (at->host == "localhost")  // it never leaves this machine, whatever a name server says (RFC 6761)
    return std::vector{loopback(false).with_port(at->port), loopback(true).with_port(at->port)};
  const auto numeric = numeric_address(text, *at);
  if (!numeric) return tl::unexpected(numeric.error());
  if (*numeric) return std::vector{**numeric};

  // AI_ADDRCONFIG leaves out a family that this machine has no address of, but loopback ones do not count for it: where
  // there are no others, it finds nothing.
  addrinfo* list = nullptr;
  int code = look_up(at->host, AI_ADDRCONFIG, list);
  if (code == EAI_NONAME || code == EAI_NODATA || code == EAI_ADDRFAMILY) code = look_up(at->host, 0, list);
  if (code != 0) {
    const std::string why = code == EAI_SYSTEM ? std::strerror(errno) : gai_strerror(code);
    return tl::unexpected(
        Error{ErrorKind::kAddress, "cannot find host '" + at->host + "': " + why + ". " + advice_for(code) + "."});
  }
  std::vector<Address> found;
  for (const addrinfo* info = list; info != nullptr; info = info->ai_next) {
    if (info->ai_family != AF_INET && info->ai_family != AF_INET6) continue;
    sockaddr_storage storage{};
    std::memcpy(&storage, info->ai_addr, std::min<std::size_t>(info->ai_addrlen, sizeof storage));
    const Address address = from_sockaddr(storage).with_port(at->port);
    if (std::find(found.begin(), found.end(), address) == found.end()) found.push_back(address);
  }
  freeaddrinfo(list);
  if (found.empty())
    return tl::unexpected(Error{
        ErrorKind::kAddress, "host '" + at->host + "' has no IPv4 or IPv6 address. " + advice_for(EAI_NODATA) + "."});
  return interleaved(found);
}

}  // namespace farfeel::transport
