// One object over the bulk lane: chunks out, ranges back, until it is all there. Time is an argument; no sockets.
//
// The sender keeps at most a window of chunks unacknowledged and spreads them over the measured round trip; the window
// grows with every acknowledged chunk and halves on loss, at most once a round trip. A chunk is taken for lost when
// one has arrived that was sent clearly later, by kReorderTolerance chunks and a quarter of a round trip, or when
// nothing came back for a few round trips. The receiver's memory is bounded by the offer, which is checked before
// anything is allocated; it is named by its hash, so an interrupted transfer goes on where it stopped, even in another
// session.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "transport/control_messages.h"

namespace farfeel::transport {

/// Sends one object. Whoever calls it puts the chunks into datagrams.
class ObjectSender {
 public:
  ObjectSender(std::uint32_t id, std::shared_ptr<const Object> object);

  [[nodiscard]] Offer offer() const;
  /// Takes what arrived. Acknowledgements of other objects, or of chunks never sent, change nothing.
  void on_acknowledge(const Acknowledge&, std::int64_t now_ns);
  /// The next chunk that may leave now, if any. Its bytes point into the object.
  [[nodiscard]] std::optional<Chunk> next_chunk(std::int64_t now_ns);
  /// When next_chunk() is worth asking again; INT64_MAX when only an acknowledgement can help.
  [[nodiscard]] std::int64_t next_time_ns(std::int64_t now_ns) const;

  [[nodiscard]] bool is_wanted() const { return is_wanted_; }  ///< the receiver has answered the offer
  [[nodiscard]] bool is_complete() const { return arrived_ == chunks_.size(); }
  [[nodiscard]] std::uint64_t resent_chunks() const { return resent_; }
  [[nodiscard]] std::int64_t round_trip_ns() const { return round_trip_ns_; }

  static constexpr std::uint32_t kReorderTolerance = 8;

 private:
  struct ChunkState {
    std::int64_t sent_ns = 0;      // 0: never, or to be sent again
    std::uint32_t send_order = 0;  // counts sendings, so that "sent after it" can be told
    bool is_resent = false;        // then it is unknown which of its sendings arrived
    bool has_arrived = false;
  };
  void mark_arrived(std::uint32_t begin, std::uint32_t end);
  void mark_lost(std::uint32_t index, std::int64_t now_ns);
  void find_lost(std::int64_t now_ns);
  [[nodiscard]] std::int64_t timeout_ns() const;

  std::uint32_t id_;
  std::shared_ptr<const Object> object_;
  std::vector<ChunkState> chunks_;
  std::vector<std::uint32_t> in_flight_;  // indices in order of sending
  std::vector<std::uint32_t> lost_;       // indices to send again
  std::uint32_t next_ = 0;                // first chunk never sent
  std::uint32_t arrived_ = 0;
  std::uint32_t complete_ = 0;  // all chunks below have arrived
  std::uint32_t sendings_ = 0;
  std::uint32_t newest_arrived_order_ = 0;  // of chunks sent once
  std::int64_t newest_arrived_sent_ns_ = 0;
  std::uint64_t resent_ = 0;
  double window_;
  std::int64_t round_trip_ns_;
  bool has_round_trip_ = false;
  std::int64_t next_send_ns_ = 0;
  std::int64_t last_cut_ns_ = 0;
  bool is_wanted_ = false;
};

/// Receives one object at a time.
class ObjectReceiver {
 public:
  /// A new hash starts over; the same hash goes on with what is there, under the offer's id.
  void on_offer(const Offer&);
  /// Takes a chunk of the offered object; true if it was new. Anything that does not fit the offer changes nothing.
  bool on_chunk(const Chunk&, std::int64_t now_ns);
  /// What has arrived so far of the offered object.
  [[nodiscard]] Acknowledge acknowledge(std::int64_t now_ns) const;

  [[nodiscard]] bool has_offer() const { return has_offer_; }
  /// object() is what the last offer named.
  [[nodiscard]] bool has_whole_offer() const { return has_offer_ && object_ && object_->hash == offer_.hash; }
  /// The whole object, its hash checked; null until then.
  [[nodiscard]] const std::shared_ptr<const Object>& object() const { return object_; }
  /// Objects that were complete and did not match their hash; each starts over.
  [[nodiscard]] std::uint64_t corrupt_objects() const { return corrupt_; }
  [[nodiscard]] double progress() const;  ///< share of the offered object that is here, 0..1

 private:
  void start(const Offer&);

  Offer offer_;
  bool has_offer_ = false;
  std::vector<std::byte> bytes_;
  std::vector<bool> has_;
  std::uint32_t received_ = 0;
  std::uint32_t complete_ = 0;  // all chunks below are here
  std::uint32_t end_ = 0;       // none from here on
  std::int64_t newest_t_send_ns_ = 0, newest_arrival_ns_ = 0;
  std::uint64_t corrupt_ = 0;
  std::shared_ptr<const Object> object_;
};

}  // namespace farfeel::transport
