// What a station needs to be told to use a relay.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "transport/error.h"
#include "transport/net/address.h"
#include "transport/relay/relay_client.h"
#include "transport/relay/relay_token.h"

namespace farfeel::transport {

inline constexpr std::uint16_t kDefaultRelayPort = 47200;

struct RelayAccess {
  Address relay;
  RelayToken token;
  std::string room;            ///< a slave's is its public key, which its masters know
  std::uint64_t instance = 0;  ///< of this process: the wall clock when it started [ns]

  /// For one of this process's lanes.
  [[nodiscard]] RelayClient::Options options(RelayRole role, std::uint8_t slot) const {
    return {relay, token, room, role, slot, instance, random_key()};
  }
};

/// where: "HOST" or "HOST:PORT"; of several addresses the first that this machine has a way to. token_file: holds what
/// `farfeel-relay token` prints. slave: the public key of whoever is met there. Looks names up, as resolve() does.
[[nodiscard]] tl::expected<RelayAccess, Error> relay_access(const std::string& where, const std::string& token_file,
                                                            const Key32& slave);

}  // namespace farfeel::transport
