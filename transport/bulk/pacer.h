// How much may leave when, so that the link is full and its queue nearly empty. Time is an argument; one thread.
//
// What is in flight is the link's rate times the time that it is away (Little's law): D = B e. Take away what stands in
// the queue, q, add what may stand there, and the window for the next round trip is
//
//   W = D + B (kShare target - q),   target = max(1 ms, RTT / 10).
//
// Where there is no queue this grows by kShare target / e a round; where the link is full it is the right window at
// once, whatever it was before. q is the mean excess of this lane's own delays over their least in the last 10 s, less
// the least such mean, so that it does not see jitter; each delay is measured there and back, without the receiver's
// hold, and one way, and the smaller excess counts: either is at least what waits in this direction. Loss plays no part
// in this, as long as it is not so much that the link must be discarding by rule.
//
// Start-up sends by twos: how far apart two arrive tells the link's rate, and the window goes no further than that.
// Where pairs disagree, jitter has made their rates, and below 4 Mbit/s they are no bound.
//
// Now and then the window is small for a round trip, so that the queue runs empty and the least delay is seen again. A
// queue that will not go away is asked: with two messages in flight for a round trip, what delay is left is the path's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "transport/bulk/sent_log.h"

namespace farfeel::transport {

/// The least value of the last ten seconds or so.
class RecentLeast {
 public:
  void note(std::int64_t value, std::int64_t now_ns);
  [[nodiscard]] std::int64_t value() const { return least_; }  ///< kNever_ns before the first
  void forget() { *this = {}; }

 private:
  static constexpr std::size_t kBuckets = 10;
  static constexpr std::int64_t kBucket_ns = 1'000'000'000;
  std::array<std::int64_t, kBuckets> buckets_{kNever_ns, kNever_ns, kNever_ns, kNever_ns, kNever_ns,
                                              kNever_ns, kNever_ns, kNever_ns, kNever_ns, kNever_ns};
  std::int64_t bucket_ = 0;
  std::int64_t least_ = kNever_ns;
};

class Pacer {
 public:
  Pacer();

  /// Whether a message of so many bytes on the wire may leave now.
  [[nodiscard]] bool may_send(std::size_t bytes, std::uint64_t in_flight_bytes, std::int64_t now_ns) const;
  /// One has left: next is the number after it.
  void on_sent(std::size_t bytes, std::uint64_t in_flight_bytes, std::uint64_t next, std::int64_t now_ns);
  /// For a message that has just left: the window, if that is what bounds what is in flight, else 0. Only messages that
  /// left then, or that waited in a queue, tell of the link.
  [[nodiscard]] std::uint64_t full_flight(std::size_t bytes, std::uint64_t in_flight_bytes) const;
  void on_news(const SentLog::News&, std::uint64_t next, std::int64_t now_ns);
  /// Nothing has been heard for timeout_ns() while something was in flight, which is now taken for lost.
  void on_silence(std::int64_t now_ns);
  /// What the haptic lane has sent from this end since it began: where that grows, bulk gives way at once.
  void on_haptic_bytes(std::uint64_t sent_in_all, std::int64_t now_ns);
  /// Another path: nothing is known of it. Its round trip, where somebody measured one.
  void restart(std::int64_t round_trip_ns = 0);

  /// When may_send() may turn true by itself; kNever_ns when only a receipt can help.
  [[nodiscard]] std::int64_t next_time_ns(std::size_t bytes, std::uint64_t in_flight_bytes, std::int64_t now_ns) const;
  [[nodiscard]] std::int64_t timeout_ns() const;
  /// After so long without a receipt one message may leave beside the window, in case all in it are lost.
  [[nodiscard]] std::int64_t probe_ns() const;
  [[nodiscard]] std::uint8_t spacing() const;  ///< between receipts, as a bulk head has it

  [[nodiscard]] std::int64_t round_trip_ns() const { return has_base() ? base_trip_.value() : 0; }  ///< the least
  /// From a message's leaving until its receipt, of late: queues, and the receiver's own time, included.
  [[nodiscard]] std::int64_t time_away_ns() const { return static_cast<std::int64_t>(trip_ns_); }
  [[nodiscard]] std::int64_t target_ns() const;
  [[nodiscard]] std::int64_t queue_ns() const { return queue_ns_; }  ///< standing, in the last round
  [[nodiscard]] double bytes_per_s() const { return 1e9 * rate_; }   ///< delivered, in the last round that was full
  [[nodiscard]] double window_bytes() const { return window_; }

 private:
  enum class Mode : std::uint8_t { kStart, kCruise, kDrain, kAsk };
  /// What the messages tell that were sent under the window of now.
  struct Round {
    std::uint64_t mark = 0;  // the first of their numbers
    std::int64_t first_ns = 0, first_full_ns = 0;
    std::int64_t excess_ns = kNever_ns;  // the least of those that were sent when the link was full
    std::int64_t excess_sum_ns = 0;
    int delays = 0, full = 0;
    double flight_bytes = 0, rate = 0;  // sums over these
  };
  [[nodiscard]] bool has_base() const { return base_trip_.value() != kNever_ns; }
  [[nodiscard]] double allowed() const;
  [[nodiscard]] bool is_coarse() const;
  [[nodiscard]] bool has_room(std::size_t bytes, std::uint64_t in_flight_bytes) const;
  void note(const SentLog::News::Delay&, std::int64_t now_ns);
  [[nodiscard]] bool is_round_over(std::int64_t now_ns) const;
  void note_loss(const SentLog::News&);
  void begin_round(std::uint64_t next);
  void end_round(std::int64_t now_ns);
  void leave_start();
  [[nodiscard]] int enough() const;
  void rebase(std::int64_t trip_ns, std::int64_t way_ns, std::int64_t now_ns);
  void grow();
  void cruise();
  void dip(Mode, double window, std::int64_t now_ns);
  void end_dip(std::int64_t now_ns);
  struct PairRate {
    double bytes_per_ns = 0;
    bool is_bound = false;  // the link carries no more; false: jitter alone may have made it
  };
  [[nodiscard]] PairRate pair_rate() const;
  [[nodiscard]] double free_rate() const;

  Mode mode_ = Mode::kStart;
  double window_;           // bytes
  double dip_window_ = 0;   // while draining or asking
  std::uint64_t dip_mark_;  // the first number after the window had room again; 0: not yet
  std::int64_t dip_ns_ = 0, dip_least_ns_ = kNever_ns, dip_least_way_ns_ = kNever_ns;
  std::int64_t dip_excess_sum_ns_ = 0, dip_delays_ = 0;
  RecentLeast base_trip_, base_way_, jitter_;  // jitter: a round's mean excess
  Round round_;
  double rate_ = 0;       // bytes/ns
  double best_rate_ = 0;  // of some rounds: what to go back to
  double trip_ns_ = 0;    // mean time away, hold included
  std::int64_t queue_ns_ = 0;
  int rounds_ = 0, calm_rounds_ = 0, queued_rounds_ = 0, silences_ = 0;
  double unsteady_ns_ = 0;  // between one delay and the next, on average
  std::int64_t last_excess_ns_ = 0;
  int patience_ = 0;            // calm rounds before start-up begins anew
  bool is_first_start_ = true;  // nothing is known of the path yet
  double start_window_ = 0;     // when start-up began
  double loss_ = 0;             // recent share
  int overshoots_ = 0;          // messages in a row that waited for more than the target, and the least of that
  std::int64_t least_overshoot_ns_ = 0;
  std::array<double, 16> pair_rates_{};     // bytes/ns, the last ones
  std::size_t pairs_ = 0, fresh_from_ = 0;  // in all; when start-up began
  bool is_second_ = false;                  // of a pair
  std::int64_t next_send_ns_ = 0;
  bool was_held_ = false;  // there was no room after the last message
  std::uint64_t haptic_bytes_ = 0;
  std::int64_t haptic_ns_ = 0;
  double haptic_fast_ = 0, haptic_slow_ = 0;  // bytes/ns
};

}  // namespace farfeel::transport
