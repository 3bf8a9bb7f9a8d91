// The slave's side of all handshakes: who may in, and the keys for those who may. Strangers cost no memory.
//
// What an initiation costs grows with what it has shown: a wrong mac1 costs a hash; under load a right one from an
// address that has not shown it is there costs a cookie; then X25519 tells who it is. Only who is on the list gets a
// slot, one for each lane: a newer initiation takes the slot, the same one again gets the same answer. An answer is
// never larger than its question. Time is an argument; no sockets.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "transport/lane/lane_keys.h"
#include "transport/net/address.h"
#include "transport/seal/cookie.h"
#include "transport/seal/handshake.h"

namespace farfeel::transport {

/// What the allow-list says of a public key.
struct Operator {
  std::string name;
  Key32 psk{};  ///< zeros: none
  bool is_expired = false;
  bool may_operate = true;                   ///< with a hand
  bool may_watch = false, may_edit = false;  ///< the scene, in a side session; who may edit may watch
};

/// An authentic question for keys.
struct Applicant {
  LaneKind lane = LaneKind::kBulk;
  Key32 key{};                ///< the operator's
  Operator allowed;           ///< as the allow-list has it
  std::uint64_t master = 0;   ///< which of the operator's processes
  std::uint32_t session = 0;  ///< that the haptic lane is for
};

/// The session's decision.
struct Admission {
  Verdict verdict = Verdict::kBusy;
  std::uint32_t session = 0;  ///< where welcome
};

class HandshakeServer {
 public:
  using Find = std::function<std::optional<Operator>(const Key32&)>;
  using Decide = std::function<Admission(const Applicant&)>;

  /// epoch: another one at each start of the slave.
  HandshakeServer(const KeyPair& own, std::uint64_t epoch, Find find, Decide decide);

  struct Result {
    std::size_t reply_bytes = 0;  ///< of the buffer, to be sent to where the initiation came from
    /// A new slot's keys: they count once a datagram has come that is sealed with them.
    std::optional<LaneKeys> keys;
    Applicant applicant;  ///< whose they are
  };
  /// datagram: of type 1. wall_ns: CLOCK_REALTIME, which is told to the master.
  [[nodiscard]] Result on_initiation(std::span<const std::byte> datagram, const Address& from, std::int64_t now_ns,
                                     std::int64_t wall_ns, std::span<std::byte, kResponseBytes> reply);
  /// The allow-list has changed: slots of keys that are not on it any more are forgotten.
  void prune();

  struct Counters {
    std::uint64_t initiations = 0;  ///< that came
    std::uint64_t welcomed = 0, repeated = 0, busy = 0;
    std::uint64_t malformed = 0, other_version = 0, other_suite = 0, wrong_key = 0, cookies = 0, forged = 0,
                  unknown = 0, expired = 0, replayed = 0;
  };
  [[nodiscard]] const Counters& counters() const { return counters_; }

 private:
  struct Slot {
    std::uint64_t counter = 0;                                           // the greatest so far
    std::array<std::byte, kInitiationBytes - 2 * kMacBytes> question{};  // without the macs, which change
    std::array<std::byte, kResponseBytes> answer{};
  };
  std::size_t deny(DenialReason, std::uint32_t sender_index, std::int64_t now_ns, std::span<std::byte> reply);

  KeyPair own_;
  std::uint64_t epoch_;
  Key32 mac1_key_;
  Find find_;
  Decide decide_;
  CookieMaker cookies_;
  std::map<std::pair<Key32, LaneKind>, Slot> slots_;     // of keys on the list alone
  std::array<std::uint64_t, kLaneKinds> generations_{};  // of each kind of lane
  double work_ = 0, denials_ = 0;                        // leaky buckets
  std::int64_t work_ns_ = 0, denials_ns_ = 0;
  Counters counters_;
};

}  // namespace farfeel::transport
