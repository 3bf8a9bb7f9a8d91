// The master's end of the bulk lane: greets, takes the object, notices silence, greets again. Time is an argument.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "transport/object_transfer.h"
#include "transport/session_server.h"

namespace farfeel::transport {

class SessionClient {
 public:
  using Send = std::function<void(std::span<const std::byte> datagram)>;

  enum class State : std::uint8_t {
    kGreeting,   ///< hello goes out with back-off until it is answered
    kConnected,  ///< session() is live
    kEnded,      ///< end() was called: nothing more will happen
  };
  struct Counters {
    std::uint64_t hellos = 0, welcomes = 0, losses = 0, ignored = 0;
  };

  /// master: random, not 0, one per process.
  explicit SessionClient(std::uint64_t master) : master_(master) {}

  /// Returns the packet when it is an application message of the live session; a status only if newer than those
  /// before.
  std::optional<Packet> on_datagram(std::span<const std::byte> datagram, std::int64_t now_ns, const Send&);
  void on_time(std::int64_t now_ns, const Send&);
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns) const;

  /// Something of the session arrived on the haptic lane at this time.
  void heard_at(std::int64_t time_ns);
  /// One application message to the slave; dropped without a session.
  void send_message(PacketType, std::span<const std::byte> payload, std::int64_t now_ns, const Send&);
  void end(const Send&);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] std::uint32_t session() const { return session_; }  ///< 0 unless connected
  [[nodiscard]] const ObjectReceiver& receiver() const { return receiver_; }
  /// Whether the live session's offer is what receiver().object() holds.
  [[nodiscard]] bool has_offered_object() const;
  /// From the hello that was answered to its welcome; 0 before any.
  [[nodiscard]] std::int64_t greeting_round_trip_ns() const { return greeting_round_trip_ns_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// Why there is no session, in the slave's words or ours; empty while connected.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  void on_welcome(const Packet&, std::int64_t now_ns);
  void on_refusal(const Packet&, std::int64_t now_ns);
  void greet_again(std::string why, std::int64_t at_ns);
  void send_packet(PacketType, std::span<const std::byte> payload, std::int64_t now_ns, const Send&);
  void acknowledge(std::int64_t now_ns, const Send&);

  std::uint64_t master_;
  State state_ = State::kGreeting;
  std::uint32_t session_ = 0;
  std::uint32_t attempt_ = 0, welcomed_attempt_ = 0;
  std::uint32_t sequence_ = 0, newest_status_ = 0;
  std::int64_t next_hello_ns_ = 0, back_off_ns_ = kFirstBackOff_ns;
  std::int64_t heard_ns_ = 0, sent_ns_ = 0, greeting_round_trip_ns_ = 0;
  std::int64_t unacknowledged_since_ns_ = 0;  // oldest chunk that no acknowledgement has told of; 0 if none
  std::uint32_t unacknowledged_ = 0;
  bool has_offer_ = false;  // in this session
  ObjectReceiver receiver_;
  Counters counters_;
  std::string trouble_ = "no answer yet";
};

}  // namespace farfeel::transport
