// The slave's end of the session: greets, lets one master in at a time, and gives it the object. Time is an argument;
// no sockets.
//
// All datagrams of the slave's port but the haptic lane's come here. Each lane is greeted, keyed and found
// again by itself; the session is what both belong to. It is one master process's until both lanes were silent for
// kSilence_ns: then another may take it, and until one does the first may come back to it while its keys live. Only
// authentic datagrams change anything; where the session's master is they alone tell.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "transport/bulk_peer.h"
#include "transport/lane/handshake_server.h"
#include "transport/side_sessions.h"

namespace farfeel::transport {

/// The one master that a slave serves.
struct ServedSession {
  std::uint32_t id = 0;  ///< random, not 0
  Key32 operator_key{};
  std::string operator_name;
  std::uint64_t master = 0;  ///< which of the operator's processes
  std::int64_t started_ns = 0;
  std::int64_t heard_ns = 0;  ///< last time anything authentic arrived, on either lane
};

/// What the contact thread needs to open and to answer.
struct HapticGrant {
  LaneKeys keys;
  Address asked_from;  ///< proven, if the first datagram with these keys comes from there too
};

class SessionServer {
 public:
  using Send = BulkPeer::Send;

  struct Settings {
    KeyPair own;
    std::uint64_t epoch = 0;  ///< another one at each start
    HandshakeServer::Find find;
    std::shared_ptr<const Object> object;  ///< what every master gets first; may be null
  };
  struct Counters {
    std::uint64_t bulk_handshakes = 0;  ///< that gave keys in a session
    std::uint64_t sessions = 0;
    std::uint64_t ignored = 0;  ///< datagrams that were junk, foreign or stale, and changed nothing
  };

  explicit SessionServer(const Settings&);
  SessionServer(const SessionServer&) = delete;
  SessionServer& operator=(const SessionServer&) = delete;

  struct Outcome {
    bool is_for_haptic = false;               ///< pass it on as it is: the contact thread opens it
    std::optional<Message> message;           ///< an application message of the live session
    bool is_opened = false;                   ///< authentic, of the live session's bulk lane
    std::optional<SideSessions::Heard> side;  ///< of a side session instead
  };
  /// Opens in place. arrival_ns: the kernel's stamp where there is one. wall_ns: CLOCK_REALTIME.
  Outcome on_datagram(const Address& from, std::span<std::byte> datagram, std::int64_t arrival_ns, std::int64_t wall_ns,
                      const Send&);
  /// Sends what bulk may, keeps alive. Call at next_time_ns() or after any on_datagram().
  void on_time(std::int64_t now_ns, const Send&);
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns);

  /// Keys for the haptic lane of the live session, once each.
  [[nodiscard]] std::optional<HapticGrant> take_haptic_grant();
  /// Something authentic arrived on the haptic lane at this time.
  void heard_at(std::int64_t time_ns);
  /// One application message to the master; dropped without a session.
  void send_message(MessageType, std::span<const std::byte> payload, std::int64_t now_ns, const Send&);
  /// What moves on the bulk lane: sources are added here, before the first session, and what the haptic lane sends is
  /// told. It is driven by on_datagram() and on_time().
  [[nodiscard]] BulkLane& bulk() { return peer_.bulk(); }
  /// Whether bulk may flow: the master is where it says it is.
  [[nodiscard]] bool may_send_bulk() const { return session_ && peer_.path().is_proven(); }
  /// Beside the master's: they are driven with it.
  [[nodiscard]] SideSessions& sides() { return sides_; }
  /// Tells the master, thrice because nobody answers, and frees the session.
  void end(ByeReason, std::int64_t now_ns, const Send&);
  /// The allow-list may have changed: ends the session of an operator who is not on it, or not any more.
  void on_changed_list(std::int64_t now_ns, const Send&);

  [[nodiscard]] const std::optional<ServedSession>& session() const { return session_; }
  [[nodiscard]] bool is_silent(std::int64_t now_ns) const {
    return session_ && now_ns - session_->heard_ns > kSilence_ns;
  }
  /// Where the bulk lane's peer is; nothing before a session.
  [[nodiscard]] const std::optional<Address>& bulk_address() const { return peer_.path().address(); }
  [[nodiscard]] const SealedLane& bulk_seal() const { return peer_.seal(); }
  [[nodiscard]] std::uint64_t bulk_moves() const { return peer_.path().moves(); }
  [[nodiscard]] const Counters& counters() const { return counters_; }
  [[nodiscard]] const HandshakeServer::Counters& handshakes() const { return shakes_.counters(); }
  /// Why the last session ended, for the log; empty before.
  [[nodiscard]] const std::string& last_end() const { return last_end_; }

 private:
  struct Candidate {  // a session that begins once a datagram comes with its keys
    ServedSession session;
    SealedLane lane{SealedLane::Role::kResponder};
    Address asked_from;
  };
  Admission decide(const Applicant&, std::int64_t now_ns);
  void on_initiation(const Address& from, std::span<const std::byte>, std::int64_t now_ns, std::int64_t wall_ns,
                     const Send&);
  std::optional<SealedLane::Opened> open(const Address& from, std::span<std::byte>, std::int64_t now_ns);
  void begin(Candidate&&, std::int64_t now_ns);
  void drop(std::string why);

  HandshakeServer::Find find_;
  std::int64_t now_ns_ = 0;  // for decide(), which the handshakes call
  HandshakeServer shakes_;
  std::optional<ServedSession> session_;
  std::optional<Candidate> candidate_;
  BulkPeer peer_;  // the master's bulk lane
  SideSessions sides_;
  std::optional<HapticGrant> grant_;
  std::array<std::uint32_t, 4> haptic_indices_{};  // of the newest keys: what may be passed on
  std::size_t next_haptic_index_ = 0;
  Counters counters_;
  std::string last_end_;
};

}  // namespace farfeel::transport
