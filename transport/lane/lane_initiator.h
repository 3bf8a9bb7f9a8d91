// The master's side of a lane's handshakes: when to make new keys, how often to ask, and what the answers mean.
//
// The keys in use go on while new ones are made. One attempt is one initiation, sent again unchanged until it is
// answered, so that answers may take longer than the pause between two sendings. Time is an argument; no sockets.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "transport/lane/lane_keys.h"
#include "transport/seal/cookie.h"
#include "transport/seal/handshake.h"

namespace farfeel::transport {

/// Who greets whom. The same for both lanes of a master process.
struct Greeter {
  KeyPair own;
  Key32 slave{};             ///< the slave's public key, pinned
  Key32 psk{};               ///< zeros: none
  std::uint64_t master = 0;  ///< random, one per process
  /// A number that never goes back, over restarts too: see transport/keys/handshake_counter.h.
  std::function<std::uint64_t()> next_counter;
  std::function<std::int64_t()> wall_clock_ns;  ///< since 1970; told to the slave, and compared with its own
  Suite suite = Suite::kAesGcm;                 ///< to begin with
};

/// Why a lane has no keys yet. All before kBusy are told in the clear: hints, which anybody can forge.
enum class GreetingTrouble : std::uint8_t {
  kNone,  ///< no answer yet, or none was needed
  kOtherVersion,
  kWrongSlaveKey,
  kUnknownOperator,
  kExpiredOperator,
  kOldCounter,
  kBusy,
  kNoSession,   ///< of the haptic lane: the slave has no such session (any more)
  kNotAllowed,  ///< this key may not do that
};

class LaneInitiator {
 public:
  LaneInitiator(LaneKind lane, const Greeter& greeter);

  /// The haptic lane is greeted for a session that the bulk lane has made; 0: not now.
  void set_session(std::uint32_t session) noexcept;
  /// The slave said goodbye: greets anew, after a pause.
  void restart(std::int64_t now_ns) noexcept;
  /// When the lane's owner last got an authentic datagram.
  void heard_at(std::int64_t time_ns) noexcept;

  /// Types 2, 3, 5 of this lane. Keys, when the handshake is finished by it.
  [[nodiscard]] std::optional<LaneKeys> on_datagram(std::span<const std::byte> datagram, std::int64_t now_ns);
  /// Writes the initiation that is due and returns its size, or 0.
  [[nodiscard]] std::size_t on_time(std::int64_t now_ns, std::span<std::byte> to);
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns) const;

  [[nodiscard]] GreetingTrouble trouble() const { return trouble_; }
  /// The slave's wall clock less this one's, at the last answer [ns].
  [[nodiscard]] std::int64_t clock_difference_ns() const { return clock_difference_ns_; }
  /// Of the last answered attempt; exact where it was sent once.
  [[nodiscard]] std::int64_t round_trip_ns() const { return round_trip_ns_; }
  [[nodiscard]] std::uint64_t initiations() const { return initiations_; }
  [[nodiscard]] std::uint64_t handshakes() const { return generation_; }
  [[nodiscard]] Suite suite() const { return suite_; }

  // Specification constants of a lane's patience.
  static constexpr std::int64_t kSilence_ns = 50'000'000;    ///< then new keys are asked for, beside the old
  static constexpr std::int64_t kAgain_ns = 20'000'000;      ///< between sendings, to a slave that has answered before
  static constexpr std::int64_t kEager_ns = 10'000'000'000;  ///< for so long; then the pause doubles
  static constexpr std::int64_t kAgainLast_ns = 500'000'000;
  /// To a slave that never answered; doubles from the start.
  static constexpr std::int64_t kFirstAgain_ns = 250'000'000;
  static constexpr std::int64_t kFirstAgainLast_ns = 2'000'000'000;
  static constexpr std::int64_t kAttempt_ns = 5'000'000'000;  ///< then a new initiation is made
  /// Or after so long, if it was denied. Anybody who sees it can forge a denial: until then the true answer is welcome.
  static constexpr std::int64_t kDenied_ns = 250'000'000;
  static constexpr std::int64_t kBusyAgain_ns = 500'000'000;  ///< after a refusal that time may mend

 private:
  struct Attempt {
    InitiatorHandshake handshake;
    std::array<std::byte, kInitiationBytes> initiation{};
    std::int64_t began_ns = 0;
    std::uint32_t sendings = 0;
    bool is_denied = false;
  };
  [[nodiscard]] bool needs_keys(std::int64_t now_ns) const;
  void begin(std::int64_t now_ns);
  [[nodiscard]] std::optional<LaneKeys> on_response(std::span<const std::byte>, std::int64_t now_ns);
  void on_denial(const Denial&);

  LaneKind lane_;
  Greeter greeter_;
  Key32 mac1_key_;
  Suite suite_;
  std::uint32_t session_ = 0;
  std::optional<Attempt> attempt_;
  CookieJar cookies_;
  std::int64_t heard_ns_ = 0, made_ns_ = 0;  // 0: never
  std::int64_t trying_ns_ = 0;               // since when nothing helped; 0: not trying
  std::int64_t next_send_ns_ = 0, pause_ns_ = 0;
  std::uint64_t generation_ = 0, initiations_ = 0;
  std::int64_t round_trip_ns_ = 0, clock_difference_ns_ = 0;
  GreetingTrouble trouble_ = GreetingTrouble::kNone;
};

}  // namespace farfeel::transport
