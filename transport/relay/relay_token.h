// The right to use a relay, as one line to paste.
//
// A token is a grant, which says what is allowed until when, and a key, which proves that the relay gave it: the keyed
// hash of the grant under the relay's own key. So the relay keeps no list: whoever signs a message with the right key
// shows the grant with it. Both ends of a session hold the same token.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "transport/bytes/byte_cursor.h"
#include "transport/error.h"
#include "transport/seal/macs.h"

namespace farfeel::transport {

/// 24 bytes on the wire, in this order. Not secret.
struct RelayGrant {
  std::uint64_t id = 0;         ///< random; tells tokens apart
  std::uint64_t expiry_s = 0;   ///< seconds since 1970, by the relay's clock
  std::uint32_t rate_kbit = 0;  ///< of all that the token's rooms forward together, both ways [kbit/s]
  std::uint16_t most_ends = 0;  ///< registered at once; a session of two lanes needs 4

  static constexpr std::size_t kBytes = 24;
  void write(ByteWriter&) const noexcept;
  static RelayGrant read(ByteReader&) noexcept;
  friend bool operator==(const RelayGrant&, const RelayGrant&) = default;
};

struct RelayToken {
  RelayGrant grant;
  Key32 key{};  ///< secret: whoever has it uses the grant
  friend bool operator==(const RelayToken&, const RelayToken&) = default;
};

/// The token that a relay with this key admits.
[[nodiscard]] RelayToken make_token(const Key32& of_relay, const RelayGrant&) noexcept;
/// "farfeel-relay-" and 75 letters, digits, - and _ .
[[nodiscard]] std::string to_string(const RelayToken&);
/// Fails (kAddress) on anything else; white space around it is left out.
[[nodiscard]] tl::expected<RelayToken, Error> parse_token(const std::string& text);

/// What a relay sees of a room's name: rooms of different tokens are different, and names are not told.
using RoomId = Mac16;
[[nodiscard]] RoomId room_id(const RelayToken&, const std::string& name) noexcept;

}  // namespace farfeel::transport
