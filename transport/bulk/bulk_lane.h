// One end of the bulk lane: everything that moves there, behind three verbs. What arrived goes into on_message(), what
// may leave comes out of next(), and next_time_ns() says when to ask again. No sockets, no sealing; time is an
// argument; one thread.
//
//   objects, tiles, ... --(BulkSource)--> by urgency -> pacer -> numbered messages -> next()
//   on_message() -> receipts -> fates of those; pieces -> objects; other bodies -> the caller
//
// Statements and receipts are small and leave before anything numbered, which the pacer alone lets out. A message is
// known to be lost when a later one has arrived: so the last one is followed by a few bytes, if by nothing else, and
// again until its fate is known.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "transport/bulk/bulk_messages.h"
#include "transport/bulk/object_inbox.h"
#include "transport/bulk/object_outbox.h"
#include "transport/bulk/pacer.h"
#include "transport/bulk/path_limit.h"
#include "transport/bulk/receipt_log.h"
#include "transport/bulk/sent_log.h"

namespace farfeel::transport {

struct BulkOptions {
  InboxLimits inbox;
  std::size_t most_datagram_bytes = kLargeDatagram;  ///< kLargeDatagram or kSmallDatagram
  std::size_t overhead_bytes = kSealedBytes + 28;    ///< of a message on the wire: sealing, UDP and IP; IPv6: 48
  std::uint64_t seed = 1;                            ///< of which numbers are skipped: not to be guessed by the peer
  std::uint64_t first_number = 0;
};

class BulkLane {
 public:
  /// A numbered message that is not this layer's to read, such as a part of a tile. Points into the message.
  struct Body {
    BulkType type{};
    std::span<const std::byte> bytes;
  };
  struct Counters {
    std::uint64_t sent = 0, sent_bytes = 0, arrived = 0, lost = 0;  // numbered messages; bytes on the wire
    std::uint64_t received = 0, repeated = 0, malformed = 0, receipts_sent = 0, statements_sent = 0, silences = 0;
  };

  /// scene: the bytes that all peers of a scene share for objects that arrive.
  BulkLane(const BulkOptions&, std::shared_ptr<ByteBudget> scene);
  BulkLane(const BulkLane&) = delete;
  BulkLane& operator=(const BulkLane&) = delete;

  /// What else is to be sent, beside the objects. It must outlive the lane.
  void add_source(BulkSource&);
  [[nodiscard]] ObjectOutbox& outbox() { return outbox_; }
  [[nodiscard]] const ObjectOutbox& outbox() const { return outbox_; }
  [[nodiscard]] ObjectInbox& inbox() { return inbox_; }
  [[nodiscard]] const ObjectInbox& inbox() const { return inbox_; }

  /// An opened datagram's plaintext of one of bulk's types, and when it arrived: the kernel's stamp if there is one.
  /// Anything malformed changes nothing.
  [[nodiscard]] std::optional<Body> on_message(std::span<const std::byte> message, std::int64_t arrival_ns);
  /// Writes the next message that may leave now, at most `to`'s size, which is at least kMostMessageBytes; 0 if there
  /// is none. It is taken as sent: a datagram that then cannot leave counts as lost.
  [[nodiscard]] std::size_t next(std::span<std::byte> to, std::int64_t now_ns);
  /// When next() is worth asking again; kNever_ns when only a message can help.
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns);
  /// What the haptic lane has sent from this end in all: where that grows, bulk gives way before the queue tells.
  void on_haptic_bytes(std::uint64_t sent_in_all, std::int64_t now_ns) { pacer_.on_haptic_bytes(sent_in_all, now_ns); }

  /// A new session with the same peer, or with its next life: numbers and ids begin anew, objects go on where they
  /// were. round_trip_ns: what the handshake took, 0 if unknown. A new seed each time.
  void restart(std::uint64_t seed, std::int64_t round_trip_ns, std::int64_t now_ns);
  /// The same session on another path: what is known of the path is forgotten.
  void on_new_path(std::int64_t round_trip_ns);
  /// As BulkOptions::overhead_bytes, where the peer's address is of the other kind now.
  void set_overhead(std::size_t bytes) { overhead_bytes_ = bytes; }

  [[nodiscard]] const Pacer& pacer() const { return pacer_; }
  [[nodiscard]] const PathLimit& path_limit() const { return path_limit_; }
  [[nodiscard]] const SentLog& sent() const { return sent_; }
  [[nodiscard]] const Counters& counters() const { return counters_; }
  /// It has acknowledged what was never sent. No receipt of it is believed from then on, and only a trickle leaves: the
  /// session had better end.
  [[nodiscard]] bool peer_lies() const { return sent_.has_lied(); }

 private:
  [[nodiscard]] std::size_t next_statement(std::span<std::byte> to, std::int64_t now_ns);
  [[nodiscard]] std::size_t next_numbered(std::span<std::byte> to, std::int64_t now_ns);
  [[nodiscard]] BulkSource* most_urgent(std::int64_t now_ns);
  void tell(const SentLog::News&, std::int64_t now_ns);
  [[nodiscard]] std::int64_t quiet_since_ns() const;
  [[nodiscard]] std::int64_t follow_ns() const;
  void check_silence(std::int64_t now_ns);
  [[nodiscard]] std::size_t full_bytes() const { return path_limit_.message_bytes() + overhead_bytes_; }

  std::size_t overhead_bytes_;
  ObjectOutbox outbox_;
  ObjectInbox inbox_;
  ReceiptLog receipts_;
  SentLog sent_;
  Pacer pacer_;
  PathLimit path_limit_;
  std::vector<BulkSource*> sources_;
  std::int64_t heard_ns_ = 0;      // when a receipt last told something, or something was last sent after a pause
  std::int64_t last_sent_ns_ = 0;  // numbered
  bool has_probed_ = false;        // since something was heard
  std::int64_t carried_ns_ = 0;    // when the last message left that carries something
  int followers_ = 0;              // sent since then, only to tell of it
  Counters counters_;
};

}  // namespace farfeel::transport
