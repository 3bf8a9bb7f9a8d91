// The slave's end of the bulk lane: greets one master at a time and gives it the object. Time is an argument; no
// sockets.
//
// Only two things can change a session: a datagram from the session's own address that carries its number, and time.
// A greeting from anybody else while a session lives is refused with the reason. Answers are never larger than what
// they answer.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "transport/object_transfer.h"
#include "transport/udp_socket.h"

namespace farfeel::transport {

// Specification constants of a session.
inline constexpr std::int64_t kSilence_ns = 2'000'000'000;     ///< nothing heard for so long: the session is lost
inline constexpr std::int64_t kKeepAlive_ns = 100'000'000;     ///< longest pause between two datagrams of one end
inline constexpr std::int64_t kFirstBackOff_ns = 250'000'000;  ///< between a master's first two hellos; then doubled
inline constexpr std::int64_t kLastBackOff_ns = 2'000'000'000;

/// The one master that a slave serves.
struct ServedSession {
  std::uint32_t id = 0;  ///< random, not 0
  std::uint64_t master = 0;
  std::uint32_t attempt = 0;  ///< of the hello that it answers
  Address address;            ///< the master's, on the bulk lane
  std::int64_t started_ns = 0;
  std::int64_t heard_ns = 0;  ///< last time anything of it arrived, on either lane
  bool is_used = false;       ///< whether anything but its hello has arrived
};

class SessionServer {
 public:
  using Send = std::function<void(const Address& to, std::span<const std::byte> datagram)>;

  struct Counters {
    std::uint64_t sessions = 0, refused = 0;
    std::uint64_t ignored = 0;  ///< datagrams that were junk, foreign or stale, and changed nothing
  };

  /// slave: random, one per process. object: what every master gets first; may be null.
  SessionServer(std::uint64_t slave, std::shared_ptr<const Object> object);

  /// Returns the packet when it is an application message of the live session.
  std::optional<Packet> on_datagram(const Address& from, std::span<const std::byte> datagram, std::int64_t now_ns,
                                    const Send&);
  /// Retransmits, keeps alive, ends a silent session. Call at next_time_ns() or after any on_datagram().
  void on_time(std::int64_t now_ns, const Send&);
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns) const;

  /// Something of the session arrived on the haptic lane at this time.
  void heard_at(std::int64_t time_ns);
  /// One application message to the master; dropped without a session.
  void send_message(PacketType, std::span<const std::byte> payload, std::int64_t now_ns, const Send&);
  /// Tells the master, thrice because nobody answers, and frees the session.
  void end(ByeReason, const Send&);

  [[nodiscard]] const std::optional<ServedSession>& session() const { return session_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Why the last session ended, for the log; empty before.
  [[nodiscard]] const std::string& last_end() const { return last_end_; }

 private:
  void on_hello(const Address& from, const Hello&, std::int64_t now_ns, const Send&);
  void refuse(const Address& to, RefusalReason, std::uint64_t master, std::uint32_t session, std::string_view text,
              const Send&);
  void start(const Address& from, const Hello&, std::int64_t now_ns);
  void send_in_session(PacketType, std::span<const std::byte> payload, std::int64_t now_ns, const Send&);

  std::uint64_t slave_;
  std::shared_ptr<const Object> object_;
  std::optional<ServedSession> session_;
  std::optional<ObjectSender> sender_;
  std::uint32_t sequence_ = 0;
  std::int64_t sent_ns_ = 0;     // last datagram to the session's master
  std::int64_t offered_ns_ = 0;  // last offer; 0 before
  Counters counters_;
  std::string last_end_;
};

}  // namespace farfeel::transport
