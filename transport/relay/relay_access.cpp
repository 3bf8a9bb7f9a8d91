#include "transport/relay/relay_access.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "transport/net/arrival_clock.h"
#include "transport/net/udp_socket.h"

namespace farfeel::transport {
namespace {

constexpr std::size_t kMostTokenText = 256;  // three times what a token has

tl::expected<RelayToken, Error> read_token(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, kMostTokenText> text;
  file.read(text.data(), text.size());
  if (!file && !file.eof())
    return tl::unexpected(Error{ErrorKind::kAddress, "cannot read the relay's token in '" + path +
                                                         "': " + std::strerror(errno) +
                                                         ". Save there what 'farfeel-relay token' printed."});
  auto token = parse_token(std::string(text.data(), static_cast<std::size_t>(file.gcount())));
  if (!token) return tl::unexpected(Error{token.error().kind, "in '" + path + "': " + token.error().message});
  return token;
}

}  // namespace

tl::expected<RelayAccess, Error> relay_access(const std::string& where, const std::string& token_file,
                                              const Key32& slave) {
  if (token_file.empty())
    return tl::unexpected(Error{ErrorKind::kAddress,
                                "a relay admits by a token: save the line that 'farfeel-relay token' prints at the "
                                "relay in a file, and name the file with --relay-token"});
  const auto token = read_token(token_file);
  if (!token) return tl::unexpected(token.error());
  const auto addresses = resolve(where, kDefaultRelayPort);
  if (!addresses) return tl::unexpected(addresses.error());
  RelayAccess access{addresses->front(), *token, {}, static_cast<std::uint64_t>(wall_clock_ns())};
  for (const std::byte byte : slave) access.room += static_cast<char>(byte);
  for (const Address& address : *addresses) {
    if (!UdpSocket::open_towards(address, {})) continue;
    access.relay = address;
    break;
  }
  return access;
}

}  // namespace farfeel::transport
