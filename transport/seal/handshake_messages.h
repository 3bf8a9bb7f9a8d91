// What stands unsealed in the datagrams of a handshake: their sizes and heads, and the denial. Little-endian.
//
//   1 initiation    u8 1, u8 version, u8 suite, u8 lane, u32 sender index; e 32; sealed s 48; sealed payload 104;
//                   mac1 16; mac2 16                                                                       = 224 B
//   2 response      u8 2, u8 version, u8 suite, u8 lane, u32 sender index, u32 receiver index; e 32;
//                   sealed payload 56; mac1 16; mac2 16, which is zeros                                    = 132 B
//   3 cookie reply  u8 3, u8 version, u16 0, u32 receiver index; nonce 24; sealed cookie 32   (cookie.h)   =  64 B
//   5 denial        u8 5, u8 version of the sender, u8 reason, u8 0, u32 receiver index                    =   8 B
//
// An index is a number that an end chose for itself. A receiver index is the other end's sender index.
// IN EVERY VERSION an initiation begins with these 8 bytes and ends in the two macs, so that a slave can tell masters
// of other versions from noise, and answer with a denial. Readers of heads cost a microsecond and change nothing.
// handshake.h reads the rest.
#pragma once

#include "transport/seal/macs.h"

namespace farfeel::transport {

inline constexpr std::uint8_t kLinkVersion = 3;

enum class DatagramType : std::uint8_t { kInitiation = 1, kResponse = 2, kCookieReply = 3, kData = 4, kDenial = 5 };
/// kSide: the only lane of a side session, which has no haptic one: of one who watches the scene or edits it.
enum class LaneKind : std::uint8_t { kHaptic = 0, kBulk = 1, kSide = 2 };
inline constexpr std::size_t kLaneKinds = 3;

inline constexpr std::size_t kInitiationBytes = 224;
inline constexpr std::size_t kResponseBytes = 132;
inline constexpr std::size_t kCookieReplyBytes = 64;
inline constexpr std::size_t kDenialBytes = 8;

/// Why a head cannot be used. kNotOurs gets no answer: something is wrong with its size, type or lane. kWrongKey is all
/// right but for mac1, and so for somebody else. The others have a right mac1. Those three are worth a denial.
enum class HeadFault : std::uint8_t { kNone, kNotOurs, kWrongKey, kOtherVersion, kOtherSuite };

struct InitiationHead {
  HeadFault fault = HeadFault::kNotOurs;
  Suite suite = Suite::kChaChaPoly;  ///< without a fault: one that is_available here
  LaneKind lane = LaneKind::kHaptic;
  std::uint32_t sender_index = 0;  ///< also where the fault is worth a denial

  [[nodiscard]] bool ok() const noexcept { return fault == HeadFault::kNone; }
};

struct ResponseHead {
  Suite suite = Suite::kChaChaPoly;
  LaneKind lane = LaneKind::kHaptic;
  std::uint32_t sender_index = 0, receiver_index = 0;
};

/// own_mac1_key: mac1_key_of the reader's own public key.
[[nodiscard]] InitiationHead read_initiation_head(std::span<const std::byte> datagram,
                                                  const Key32& own_mac1_key) noexcept;
/// Nothing unless size, version, suite, lane, mac1 and the zeros of mac2 are right.
[[nodiscard]] std::optional<ResponseHead> read_response_head(std::span<const std::byte> datagram,
                                                             const Key32& own_mac1_key) noexcept;

enum class DenialReason : std::uint8_t {
  kOtherSuite = 1,
  kOtherVersion = 2,
  kWrongKey = 3,         ///< the initiation is for the holder of another key
  kUnknownOperator = 4,  ///< the sender's key is not on the list
  kExpiredOperator = 5,
  kOldCounter = 6,  ///< the slave has seen a greater one of that key
};

/// A slave's hint why it does not answer an initiation. Anybody can forge it, so whoever reads it tries another suite,
/// or tells the person, and goes on trying: it believes whatever is sealed more.
struct Denial {
  std::uint8_t version = kLinkVersion;  ///< of who denies
  DenialReason reason = DenialReason::kOtherSuite;
  std::uint32_t receiver_index = 0;
};

void write_denial(const Denial&, std::span<std::byte, kDenialBytes> out) noexcept;
[[nodiscard]] std::optional<Denial> read_denial(std::span<const std::byte> datagram) noexcept;

}  // namespace farfeel::transport
