// The slave's end of one peer's bulk lane: sealed, paced, kept alive, and following the peer to where it is. Of the
// master's session and of each side session there is one. Time is an argument; no sockets; one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "transport/bulk/bulk_lane.h"
#include "transport/control_messages.h"
#include "transport/lane/peer_path.h"
#include "transport/lane/sealed_lane.h"

namespace farfeel::transport {

// Specification constants of a session.
inline constexpr std::int64_t kSilence_ns = 2'000'000'000;  ///< of all its lanes: then another may have its place
inline constexpr std::int64_t kKeepAlive_ns = 20'000'000;   ///< longest pause between two datagrams of a lane's end

class BulkPeer {
 public:
  using Send = std::function<void(const Address& to, std::span<const std::byte> datagram)>;

  BulkPeer();

  /// A new session, whose keys were sent there. round_trip_ns: 0 if unknown.
  void begin(SealedLane&& seal, const Address& asked_from, std::int64_t round_trip_ns, std::int64_t now_ns);
  /// New keys of the same session.
  void renew(const LaneKeys&, const Address& asked_from);
  /// The session is over: nothing is opened or sent.
  void forget();

  [[nodiscard]] std::optional<SealedLane::Opened> open(std::span<std::byte> datagram, std::int64_t now_ns) {
    return seal_.open(datagram, now_ns);
  }
  /// What was opened came from there: the peer may have moved.
  void follow(const Address& from, std::size_t bytes, const SealedLane::Opened&);
  struct Read {
    bool is_ignored = false;         ///< malformed, or nobody's
    std::optional<Message> message;  ///< the session's; nothing where it was the lane's own
  };
  [[nodiscard]] Read read(const Address& from, const SealedLane::Opened&, std::int64_t now_ns);

  /// One message; dropped where the peer's place is not proven and too much went there.
  void send(MessageType, std::span<const std::byte> payload, std::int64_t now_ns, const Send&);
  /// Thrice, because nobody answers.
  void say_bye(ByeReason, std::int64_t now_ns, const Send&);
  /// Proves the place, sends what bulk may, keeps alive.
  void on_time(std::int64_t now_ns, const Send&);
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns);

  [[nodiscard]] BulkLane& bulk() { return bulk_; }
  [[nodiscard]] const SealedLane& seal() const { return seal_; }
  [[nodiscard]] const PeerPath& path() const { return path_; }

 private:
  void send_bulk(std::int64_t now_ns, const Send&);

  SealedLane seal_{SealedLane::Role::kResponder};
  BulkLane bulk_;
  PeerPath path_;
  std::int64_t sent_ns_ = 0;  // last datagram
};

}  // namespace farfeel::transport
