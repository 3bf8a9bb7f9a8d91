// The master's end of the session: greets on both lanes, takes the object, notices silence. Or the other end of a side
// session, which is the same without a haptic lane. Time is an argument; no sockets.
//
// The bulk lane makes the session, the haptic lane joins it. After that each lives by itself: one that falls silent
// asks for new keys while its old ones are still listened to, and nothing is lost when either is heard again.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "transport/bulk/bulk_lane.h"
#include "transport/control_messages.h"
#include "transport/lane/lane_initiator.h"
#include "transport/lane/sealed_lane.h"

namespace farfeel::transport {

class SessionClient {
 public:
  /// To the slave, from the lane's own socket.
  using Send = std::function<void(LaneKind, std::span<const std::byte> datagram)>;

  /// Which of the slave's objects; others are refused.
  enum class Takes : std::uint8_t { kNothing, kScene, kSaved };

  struct Counters {
    std::uint64_t bulk_handshakes = 0;  ///< that gave keys in a session
    std::uint64_t sessions = 0;         ///< 1 while nothing was lost
    std::uint64_t ignored = 0;          ///< datagrams that changed nothing
    std::uint64_t echoes = 0;           ///< initiations, which no slave sends: what this end sent comes back
  };

  explicit SessionClient(const Greeter& greeter) : SessionClient(greeter, LaneKind::kBulk, Takes::kScene) {}
  /// lane: kBulk of a master, kSide of a side session.
  SessionClient(const Greeter&, LaneKind lane, Takes);

  /// Of the bulk lane's socket; opened in place. arrival_ns: the kernel's stamp where there is one. The message is an
  /// application's of the live session.
  std::optional<Message> on_datagram(std::span<std::byte> datagram, std::int64_t arrival_ns, const Send&);
  /// What came on the haptic lane's socket and is no data: a handshake's.
  void on_haptic_handshake(std::span<const std::byte> datagram, std::int64_t now_ns);
  void on_time(std::int64_t now_ns, const Send&);
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns);

  /// Whether the haptic lane is in use: its thread runs, and wants contacts. Else nobody greets on it.
  void use_haptic(bool is_used);
  /// Something authentic arrived on the haptic lane at this time.
  void haptic_heard_at(std::int64_t time_ns);
  /// New keys for the haptic lane, once each.
  [[nodiscard]] std::optional<LaneKeys> take_haptic_keys();

  /// One application message to the slave; dropped without a session.
  void send_message(MessageType, std::span<const std::byte> payload, std::int64_t now_ns, const Send&);
  void end(std::int64_t now_ns, const Send&);

  [[nodiscard]] std::uint32_t session() const { return session_; }  ///< 0 before the first and after the end
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }      ///< of the slave: another one after its restart
  /// When the bulk lane last heard the slave; 0: never.
  [[nodiscard]] std::int64_t bulk_heard_ns() const { return heard_ns_; }
  /// Whether anything was heard within kSilence_ns.
  [[nodiscard]] bool is_heard(std::int64_t now_ns) const;
  /// The newest scene that is whole, of this session or an earlier one; nothing before any.
  [[nodiscard]] const std::optional<ReceivedObject>& scene() const { return scene_; }
  /// Whether that is what the slave offers in the live session.
  [[nodiscard]] bool has_offered_scene() const;
  /// The newest scene as files that is whole; nothing before any.
  [[nodiscard]] const std::optional<ReceivedObject>& saved() const { return saved_; }
  [[nodiscard]] double progress() const;  ///< share of the offered scene that is here, 0..1
  /// Bytes that are here of what is on its way.
  [[nodiscard]] std::uint64_t bytes_here() const { return bulk_->inbox().progress().here; }
  [[nodiscard]] const BulkLane& bulk() const { return *bulk_; }
  /// From the greeting that was answered to its answer; 0 before any.
  [[nodiscard]] std::int64_t greeting_round_trip_ns() const { return bulk_shake_.round_trip_ns(); }
  [[nodiscard]] const LaneInitiator& bulk_greeting() const { return bulk_shake_; }
  [[nodiscard]] const LaneInitiator& haptic_greeting() const { return haptic_shake_; }
  [[nodiscard]] const SealedLane& bulk_seal() const { return seal_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Why there is no session or nothing is heard, for a person; empty while all is well.
  [[nodiscard]] std::string trouble(std::int64_t now_ns) const;

 private:
  void on_keys(const LaneKeys&, std::int64_t now_ns);
  void leave(std::string why, std::int64_t now_ns);
  std::optional<Message> on_bulk(const SealedLane::Opened&, std::int64_t arrival_ns, const Send&);
  void send_bulk(std::int64_t now_ns, const Send&);
  void take_objects();

  LaneKind lane_;
  LaneInitiator bulk_shake_, haptic_shake_;
  SealedLane seal_{SealedLane::Role::kInitiator};  // of the bulk lane
  std::optional<LaneKeys> haptic_keys_;
  bool has_ended_ = false, uses_haptic_ = false;
  std::uint32_t session_ = 0;
  std::uint64_t epoch_ = 0;
  std::int64_t began_ns_ = 0;  // the first on_time()
  std::int64_t heard_ns_ = 0, haptic_heard_ns_ = 0, sent_ns_ = 0;
  std::unique_ptr<BulkLane> bulk_;  // its sources have pointers to it
  std::optional<ReceivedObject> scene_, saved_;
  Counters counters_;
  std::string end_words_;  // the slave's, or ours, why the session ended
};

}  // namespace farfeel::transport
