// What ends and a relay say to each other, byte for byte in PROTOCOL-relay.md.
//
// The first byte is 16 or above, and so none of these is taken for a datagram of the link, whose types are below.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "transport/net/address.h"
#include "transport/relay/relay_token.h"

namespace farfeel::transport {

inline constexpr std::uint8_t kFirstRelayType = 16;
inline constexpr std::uint8_t kRelayVersion = 1;
inline constexpr std::uint8_t kRelaySlots = 4;  ///< pairs of ends in a room; a lane each

enum class RelayType : std::uint8_t { kRegister = 16, kChallenge = 17, kRegistered = 18, kRefused = 19, kProbe = 20 };
enum class RelayRole : std::uint8_t { kMaster = 0, kSlave = 1 };

/// End to relay: I am this end of this room.
struct RegisterMessage {
  static constexpr std::size_t kBytes = 112;  ///< more than any answer has
  RelayRole role = RelayRole::kMaster;
  std::uint8_t slot = 0;
  std::uint64_t nonce = 0;     ///< new each time; the answer repeats it
  std::uint64_t instance = 0;  ///< of the end; the greater one wins a slot that two want
  RelayGrant grant;
  RoomId room{};
  Mac16 cookie{};  ///< zeros until the relay gave one
};
/// Relay to end: show that you receive at your address, by sending this cookie.
struct ChallengeMessage {
  static constexpr std::size_t kBytes = 28;
  std::uint64_t nonce = 0;
  Mac16 cookie{};
};
/// Relay to end: what you send to me goes to your peer from now on, and the other way.
struct RegisteredMessage {
  static constexpr std::size_t kBytes = 100;
  std::uint8_t slot = 0;
  std::uint64_t nonce = 0;  ///< of the last register message
  Mac16 cookie{};           ///< for the next one
  Address own;              ///< where the relay sees this end
  std::optional<Address> peer;
  Mac16 probe_secret{};  ///< what this pair's probes bear; means nothing without a peer
};
enum class RelayRefusal : std::uint8_t {
  kUnknownToken = 1,
  kExpired = 2,
  kFull = 3,
  kSlotTaken = 4,
  kOtherVersion = 5
};
/// Relay to end. Not signed: a hint to tell people, never believed while registration succeeds.
struct RefusedMessage {
  static constexpr std::size_t kBytes = 20;
  RelayRefusal reason = RelayRefusal::kUnknownToken;
  std::uint64_t nonce = 0;
  std::int64_t wall_clock_s = 0;  ///< the relay's, by which tokens expire
};
/// End to end, past the relay: this way is open.
struct ProbeMessage {
  static constexpr std::size_t kBytes = 20;
  std::uint8_t slot = 0;
  bool has_heard = false;  ///< it answers a probe
  Mac16 secret{};
};

/// The type of a message of this protocol, or nothing if it is a datagram of the link.
[[nodiscard]] std::optional<std::uint8_t> relay_type(std::span<const std::byte> datagram) noexcept;

/// Each writes exactly kBytes into `to`, which has room for them. Those with a key are signed with it.
void write(const RegisterMessage&, const Key32&, std::span<std::byte> to) noexcept;
void write(const ChallengeMessage&, std::span<std::byte> to) noexcept;
void write(const RegisteredMessage&, const Key32&, std::span<std::byte> to) noexcept;
void write(const RefusedMessage&, std::span<std::byte> to) noexcept;
void write(const ProbeMessage&, std::span<std::byte> to) noexcept;

/// Nothing unless it is such a message, of this version, in exactly its length, each field in its range. Signatures are
/// not looked at: see is_signed.
[[nodiscard]] std::optional<RegisterMessage> read_register(std::span<const std::byte>) noexcept;
[[nodiscard]] std::optional<ChallengeMessage> read_challenge(std::span<const std::byte>) noexcept;
[[nodiscard]] std::optional<RegisteredMessage> read_registered(std::span<const std::byte>) noexcept;
[[nodiscard]] std::optional<RefusedMessage> read_refused(std::span<const std::byte>) noexcept;
[[nodiscard]] std::optional<ProbeMessage> read_probe(std::span<const std::byte>) noexcept;

/// Whether the last 16 bytes are the keyed hash of those before.
[[nodiscard]] bool is_signed(std::span<const std::byte> message, const Key32&) noexcept;

}  // namespace farfeel::transport
