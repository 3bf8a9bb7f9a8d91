// A lane's handshake as whole datagrams: Noise (noise.h) inside the layouts of handshake_messages.h.
//
//   master: InitiatorHandshake(...)  write_initiation  ---->  slave: read_initiation_head  (cheap: mac1, then mac2)
//                                                                    ResponderHandshake(head, own)  read_initiation
//           read_response_head       <------------------------       write_response
//           read_response -> keys                                    -> keys
//
// The prologue, which both ends hash first, is "farfeel 3" and the initiation's type, version, suite and lane. The
// indices stand in the heads for whoever sorts datagrams, and again inside the sealed payloads, where nobody can change
// them:
//   initiation  u64 counter, u64 master, i64 wall clock, u32 sender index, u32 session, zeros              =  88 B
//   response    u64 epoch, u32 session, u8 verdict, 3 zeros, i64 wall clock, u32 sender index,
//               u32 receiver index, zeros                                                                  =  40 B
// The zeros at the end are written so and not looked at: room for later.
//
// An object serves one handshake on one thread, and wipes its secrets when it ends. Nothing allocates or asks for the
// time. A whole side costs some 200 us, so none of it belongs in a haptic tick.
#pragma once

#include "transport/seal/handshake_messages.h"
#include "transport/seal/noise.h"

namespace farfeel::transport {

/// The psk of those who have agreed on none.
inline constexpr Key32 kNoPsk{};

struct InitiationPayload {
  std::uint64_t counter = 0;       ///< never goes back for a key: the slave refuses what is not greater than the last
  std::uint64_t master = 0;        ///< random, one per master process
  std::int64_t wall_clock_ns = 0;  ///< since 1970; for telling a clock that is far off, never for refusing
  std::uint32_t session = 0;       ///< that a haptic lane is to join; 0 on the bulk lane
};

enum class Verdict : std::uint8_t { kWelcome = 0, kBusy = 1, kNoSession = 2, kNotAllowed = 3 };

struct ResponsePayload {
  std::uint64_t epoch = 0;    ///< of the slave, greater at every start
  std::uint32_t session = 0;  ///< 0: refused, and verdict says why
  Verdict verdict = Verdict::kWelcome;
  std::int64_t wall_clock_ns = 0;
};

struct Response {
  std::uint32_t sender_index = 0;  ///< where the slave wants data to be addressed
  ResponsePayload payload;
  SplitKeys keys;
};

struct Initiation {
  Key32 sender{};  ///< the master's public key. Whoever sent this holds its secret, or replays its holder: see counter
  InitiationPayload payload;
};

class InitiatorHandshake {
 public:
  /// Precondition: is_available(suite).
  InitiatorHandshake(Suite suite, LaneKind lane, std::uint32_t sender_index, const KeyPair& own,
                     const Key32& remote_public, const Key32& psk) noexcept;

  /// With mac1, and zeros as mac2: a CookieJar adds that. Once only: another try is another handshake. False if it was
  /// written already, or remote_public is a weak key.
  [[nodiscard]] bool write_initiation(const InitiationPayload&, std::span<std::byte, kInitiationBytes> out) noexcept;
  /// Nothing unless every byte is what the holder of remote_public sent in answer; then nothing is changed, and the
  /// true answer can still come. mac1 is not looked at: read_response_head has done that.
  [[nodiscard]] std::optional<Response> read_response(std::span<const std::byte> datagram) noexcept;

  [[nodiscard]] std::uint32_t sender_index() const noexcept { return sender_index_; }
  [[nodiscard]] Suite suite() const noexcept { return suite_; }
  [[nodiscard]] LaneKind lane() const noexcept { return lane_; }

 private:
  NoiseInitiator noise_;
  Key32 remote_mac1_key_;
  std::uint32_t sender_index_;
  Suite suite_;
  LaneKind lane_;
};

class ResponderHandshake {
 public:
  /// Precondition: head.ok().
  ResponderHandshake(const InitiationHead& head, const KeyPair& own) noexcept;

  /// Nothing unless every byte is as the holder of the sender's key sent it, less the macs: read_initiation_head has
  /// looked at mac1. The object is of no use then.
  [[nodiscard]] std::optional<Initiation> read_initiation(std::span<const std::byte> datagram) noexcept;
  /// After read_initiation, once. psk: as agreed for the sender's key, else kNoPsk.
  [[nodiscard]] SplitKeys write_response(std::uint32_t sender_index, const Key32& psk, const ResponsePayload&,
                                         std::span<std::byte, kResponseBytes> out) noexcept;

 private:
  InitiationHead head_;
  NoiseResponder noise_;
  Key32 initiator_{};
};

}  // namespace farfeel::transport
