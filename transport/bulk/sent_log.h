// What this end has sent under which number, and what receipts say of it: what arrived, how long it took, what is lost.
//
// A receipt is believed only if its newest number was sent and its echo is the time that was sent with it, which only
// the datagram itself tells; and some numbers are never used, so that a receiver which acknowledges what it did not get
// names one of these before long. A receipt that is not believed changes nothing; one that names a number which was
// never sent is a lie, and nothing of that peer is believed afterwards.
//
// A message is lost when one that was sent later by more than the reorder window has arrived, or when nothing at all
// was heard for a timeout. The window grows when something that was taken for lost does arrive. One thread.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <vector>

#include "transport/bulk/bulk_messages.h"
#include "transport/bulk/bulk_source.h"

namespace farfeel::transport {

class SentLog {
 public:
  struct Message {
    std::int64_t sent_ns = 0;
    std::uint32_t t_send_us = 0;
    std::uint32_t arrival_us = 0;         // of the receiver's clock, where has_stamp
    std::uint32_t bytes = 0;              // on the wire
    std::uint64_t flight_bytes = 0;       // in flight when it had left, itself included
    std::uint64_t tag = 0;                // the source's
    std::uint32_t source = 0;             // the lane's
    std::uint32_t run = 0;                // arrived: how many before it arrived with it or earlier, without a gap
    std::uint64_t full_flight_bytes = 0;  // the window, if that held back the next one; else 0
    bool has_stamp = false;
    bool is_large = false;  // longer than a small datagram
    bool follows = false;   // left together with the one before
    enum class State : std::uint8_t { kSent, kArrived, kLost, kSkipped } state = State::kSent;
  };
  /// What one receipt told. Valid until the next call.
  struct News {
    bool is_believed = false;
    struct Fate {
      std::uint64_t tag = 0;
      std::uint32_t source = 0, bytes = 0;
      bool is_large = false, was_lost = false;
    };
    std::vector<Fate> arrived, lost;
    /// Of a message that arrived and is stamped. round_trip_ns is without the receiver's hold, away_ns with it;
    /// one_way_ns has an unknown constant in it; interval_ns is the time to the arrival of the one before, where both
    /// left together, else 0.
    struct Delay {
      std::uint64_t number = 0;
      std::int64_t round_trip_ns = 0, away_ns = 0, one_way_ns = 0, interval_ns = 0;
      std::uint64_t flight_bytes = 0, full_flight_bytes = 0;
      std::uint32_t bytes = 0;
    };
    std::vector<Delay> delays;
    std::uint64_t newest = 0;  ///< the greatest number that has arrived
  };

  /// Equal seeds skip equal numbers. Numbers begin after `first`.
  explicit SentLog(std::uint64_t seed, std::uint64_t first = 0);

  /// The head for the next message: its number is taken by add().
  [[nodiscard]] BulkHead next_head(BulkType, std::uint8_t spacing, std::int64_t now_ns);
  void add(const BulkHead&, const Message&);
  [[nodiscard]] const News& on_receipt(const Receipt&, std::int64_t now_ns);
  /// Takes everything in flight for lost that was sent before then: nothing is heard of it.
  [[nodiscard]] const News& on_silence(std::int64_t before_ns);

  [[nodiscard]] std::uint64_t next_number() const { return next_; }
  [[nodiscard]] std::uint64_t in_flight_bytes() const { return in_flight_bytes_; }
  [[nodiscard]] std::uint64_t arrived_bytes() const { return arrived_bytes_; }
  [[nodiscard]] std::uint64_t late_messages() const { return late_; }  ///< taken for lost, and arrived
  [[nodiscard]] std::uint64_t disbelieved_receipts() const { return disbelieved_; }
  [[nodiscard]] bool has_lied() const { return has_lied_; }  ///< it named a number that was never sent
  [[nodiscard]] std::int64_t oldest_in_flight_ns() const;    ///< when it was sent; kNever_ns if none
  /// One that was sent by more than this before another which has arrived is lost.
  [[nodiscard]] std::int64_t reorder_window_ns() const { return std::max(reorder_ns_, round_trip_ns_ / 8); }

 private:
  [[nodiscard]] Message* find(std::uint64_t number);
  [[nodiscard]] bool is_credible(const Receipt&);
  void take_range(std::uint64_t begin, std::uint64_t end, std::int64_t now_ns);
  void find_lost();
  void lose(Message&);
  void forget();

  std::mt19937_64 random_;
  std::deque<Message> log_;
  std::uint64_t first_, next_;        // numbers of log_.front() and behind log_.back()
  std::uint64_t open_;                // no message below is in flight
  std::uint64_t skip_;                // the next number that is not used
  std::uint64_t newest_arrived_ = 0;  // number
  std::int64_t newest_sent_ns_ = 0;   // the latest sending that has arrived
  std::int64_t reorder_ns_, round_trip_ns_ = 0;
  std::uint64_t in_flight_bytes_ = 0, arrived_bytes_ = 0, late_ = 0, disbelieved_ = 0;
  bool has_lied_ = false;
  News news_;
};

}  // namespace farfeel::transport
