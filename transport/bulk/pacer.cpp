#include "transport/bulk/pacer.h"

#include <algorithm>
#include <cmath>

namespace farfeel::transport {
namespace {

constexpr double kMessage = 1'260;                    // a full one on the wire [bytes]
constexpr std::int64_t kLeastTarget_ns = 1'000'000;   // what bulk may add to the haptic lane, or
constexpr std::int64_t kTargetShare = 10;             // so much of the round trip
constexpr double kShare = 0.4;                        // of the target: the rest is for what is not steady
constexpr double kFloor = 256e3 / 8 * 1e-9;           // bytes/ns: slower than this it need not go,
constexpr double kFirstRate = 1e6 / 8 * 1e-9;         // and this fast it begins
constexpr double kPaceGain = 1.08;                    // the window decides; pacing only keeps it from bursts
constexpr double kCoarse = 2.5, kCoarseShare = 0.96;  // messages; of the rate that pairs tell
constexpr double kNearlyFull = 0.9;                   // of the window: pacing keeps it from being full all the time
constexpr std::int64_t kQuantum_ns = 250'000;         // what is due within this leaves together: fewer wake-ups
// A round is so long, or a quarter of a round trip if that is more, beyond the way there and back, and so many messages
// were sent in it when the link was full; if there are fewer, it is over after this or a round trip.
constexpr std::int64_t kLeastRound_ns = 2'000'000, kMostRound_ns = 20'000'000;
constexpr int kLeastFull = 4, kUnsteadyFull = 16, kLeastStartFull = 2;
constexpr double kSpreads = 2;  // of a mean
constexpr double kJitters = 4;  // differences from one delay to the next: beyond them it is no jitter
constexpr double kStartGain = 2, kMostGain = 1.5, kLeastGain = 1.1;  // of the window, a round
constexpr int kPatience = 4, kMostPatience = 200;                    // calm rounds before start-up begins anew
constexpr int kCalm = 7;        // a queue of less than its target's seventh is none
constexpr double kFound = 1.2;  // of the window: worth the trial
constexpr std::size_t kFirstPairs = 2;
// Between the quartiles of the rates that pairs tell. Jitter that is spread evenly makes 3.7: differences of two such
// delays have their quartiles at 0.13 and 0.5 of the most. A bottleneck alone spaces all pairs alike.
constexpr double kPairsDisagree = 2.5;
constexpr double kBlindRate = 4e6 / 8 * 1e-9;  // bytes/ns: up to this start-up goes on where pairs disagree
constexpr double kPairShare = 0.9;             // of the rate that pairs tell, when start-up ends
constexpr int kDrainEvery = 8;                 // rounds
constexpr double kDrainShare = 0.94;           // of what fills the link without a queue
constexpr int kAskAfter = 5;                   // rounds of a queue over its target
constexpr double kAskWindow = 2 * kMessage;
constexpr double kBackShare = 0.75;                     // of the former rate, when the path turned out to be longer
constexpr double kMuchLoss = 0.1;                       // more than lines lose: somebody discards by rule
constexpr double kLossMemory = 1.0 / 64;                // messages
constexpr std::int64_t kSlack_ns = 20'000'000;          // a busy machine may hold an answer for some scheduler's slices
constexpr std::int64_t kProbeSlack_ns = 2'000'000;      // one more message costs little: asked sooner
constexpr std::int64_t kFirstTimeout_ns = 300'000'000;  // while no round trip is known
constexpr std::int64_t kMostTimeout_ns = 500'000'000;   // so that an end that comes back is noticed
constexpr double kHapticFast_ns = 10e6;

}  // namespace

void RecentLeast::note(std::int64_t value, std::int64_t now_ns) {
  const std::int64_t bucket = now_ns / kBucket_ns;
  if (bucket != bucket_) {
    const std::int64_t passed = std::min<std::int64_t>(bucket - bucket_, kBuckets);
    for (std::int64_t i = 0; i < passed; ++i) buckets_[static_cast<std::size_t>(bucket - i) % kBuckets] = kNever_ns;
    bucket_ = bucket;
    least_ = *std::min_element(buckets_.begin(), buckets_.end());
  }
  std::int64_t& least = buckets_[static_cast<std::size_t>(bucket) % kBuckets];
  least = std::min(least, value);
  least_ = std::min(least_, value);
}

Pacer::Pacer() : window_(kMessage) {
  restart();
}

void Pacer::restart(std::int64_t round_trip_ns) {
  mode_ = Mode::kStart;
  is_first_start_ = true;
  window_ = std::max(kMessage, kFirstRate * static_cast<double>(round_trip_ns));
  dip_mark_ = 0;
  base_trip_.forget(), base_way_.forget(), jitter_.forget();
  round_ = {};
  rate_ = best_rate_ = 0;
  trip_ns_ = static_cast<double>(round_trip_ns);
  queue_ns_ = 0;
  rounds_ = calm_rounds_ = queued_rounds_ = silences_ = 0;
  loss_ = 0;
  pairs_ = fresh_from_ = 0;
  overshoots_ = 0;
  unsteady_ns_ = 0;
  patience_ = kPatience;
  is_second_ = false;
}

std::int64_t Pacer::target_ns() const {
  return has_base() ? std::max(kLeastTarget_ns, base_trip_.value() / kTargetShare) : kLeastTarget_ns;
}

double Pacer::allowed() const {
  const bool dips = mode_ == Mode::kDrain || mode_ == Mode::kAsk;
  double window = dips ? dip_window_ : window_;
  // What the haptic lane has begun to take, the window has not yet learnt.
  const double more = haptic_fast_ - haptic_slow_;
  if (more > 0 && rate_ > 0) window *= std::max(0.1, 1 - more / rate_);
  return std::max({window, kMessage, kFloor * trip_ns_});
}

/// The window is one or two messages: too coarse a measure.
bool Pacer::is_coarse() const {
  return window_ < kCoarse * kMessage;
}

bool Pacer::has_room(std::size_t bytes, std::uint64_t in_flight_bytes) const {
  // To the nearest message; but less where one alone takes longer than the target.
  const auto size = static_cast<double>(bytes);
  const bool is_slow = rate_ > 0 && size / rate_ > static_cast<double>(target_ns());
  const double share = !is_slow ? 0.5 : is_coarse() ? 1 : 0.9;
  return in_flight_bytes == 0 || static_cast<double>(in_flight_bytes) + share * size <= allowed();
}

std::uint64_t Pacer::full_flight(std::size_t bytes, std::uint64_t in_flight_bytes) const {
  const double window = allowed();
  const bool is_held = !has_room(bytes, in_flight_bytes);
  if (is_held && (is_coarse() || static_cast<double>(in_flight_bytes) > window)) return in_flight_bytes;
  const bool is_full = is_held || static_cast<double>(in_flight_bytes) > kNearlyFull * window;
  return is_full ? static_cast<std::uint64_t>(window) : 0;
}

bool Pacer::may_send(std::size_t bytes, std::uint64_t in_flight_bytes, std::int64_t now_ns) const {
  const bool makes_pair =
      is_second_ && is_first_start_ && pairs_ < kFirstPairs;  // even on a link that is full with one message
  if (!makes_pair && !has_room(bytes, in_flight_bytes)) return false;
  return is_second_ || next_send_ns_ <= now_ns + kQuantum_ns;
}

std::int64_t Pacer::next_time_ns(std::size_t bytes, std::uint64_t in_flight_bytes, std::int64_t now_ns) const {
  const bool makes_pair = is_second_ && is_first_start_ && pairs_ < kFirstPairs;
  if (!makes_pair && !has_room(bytes, in_flight_bytes)) return kNever_ns;
  return is_second_ ? now_ns : std::max(now_ns, next_send_ns_ - kQuantum_ns / 2);
}

void Pacer::on_sent(std::size_t bytes, std::uint64_t in_flight_bytes, std::uint64_t next, std::int64_t now_ns) {
  const bool dips = mode_ == Mode::kDrain || mode_ == Mode::kAsk;
  if (dips && dip_mark_ == 0 && static_cast<double>(in_flight_bytes) <= allowed() + kMessage) dip_mark_ = next;
  // In start-up messages leave by twos: how far apart these arrive tells the link's rate.
  is_second_ = mode_ == Mode::kStart && !is_second_;
  if (trip_ns_ <= 0) return;
  double rate = kPaceGain * allowed() / trip_ns_;
  // A window of one or two messages is too coarse a measure: one that leaves as soon as there is room waits at once.
  if (window_ < (kCoarse + 1) * kMessage && pairs_ >= kFirstPairs) rate = std::min(rate, kCoarseShare * free_rate());
  rate = std::max(rate, kFloor);
  const auto spacing_ns = static_cast<std::int64_t>(static_cast<double>(bytes) / rate);
  // Who is woken late catches up with half a target's worth: more would stand in the queue. Who waited for room, with
  // nothing: that was the link's own pace.
  next_send_ns_ = std::max(next_send_ns_, was_held_ ? now_ns : now_ns - target_ns() / 2) + spacing_ns;
  was_held_ = !has_room(bytes, in_flight_bytes);
}

void Pacer::begin_round(std::uint64_t next) {
  round_ = {};
  round_.mark = next;
}

void Pacer::note(const SentLog::News::Delay& delay, std::int64_t now_ns) {
  if (!has_base() && trip_ns_ <= 0) window_ = std::max(window_, kFirstRate * static_cast<double>(delay.round_trip_ns));
  base_trip_.note(delay.round_trip_ns, now_ns);
  base_way_.note(delay.one_way_ns, now_ns);
  const auto away_ns = static_cast<double>(delay.away_ns);
  trip_ns_ = trip_ns_ > 0 ? trip_ns_ + (away_ns - trip_ns_) / 16 : away_ns;
  const std::int64_t excess_ns =
      std::min(delay.round_trip_ns - base_trip_.value(), delay.one_way_ns - base_way_.value());
  unsteady_ns_ += (std::abs(static_cast<double>(excess_ns - last_excess_ns_)) - unsteady_ns_) / 16;
  last_excess_ns_ = excess_ns;
  overshoots_ = excess_ns > target_ns() ? overshoots_ + 1 : 0;
  least_overshoot_ns_ = overshoots_ <= 1 ? excess_ns : std::min(least_overshoot_ns_, excess_ns);
  if (dip_mark_ != 0 && delay.number >= dip_mark_) {
    dip_least_ns_ = std::min(dip_least_ns_, delay.round_trip_ns);
    dip_least_way_ns_ = std::min(dip_least_way_ns_, delay.one_way_ns);
    dip_excess_sum_ns_ += excess_ns;
    ++dip_delays_;
  }
  if (delay.interval_ns > 0)
    pair_rates_[pairs_++ % pair_rates_.size()] =
        static_cast<double>(delay.bytes) / static_cast<double>(delay.interval_ns);
  if (delay.number < round_.mark) return;
  if (round_.delays++ == 0) round_.first_ns = now_ns;
  // A link with a queue is full, whoever filled it.
  const bool waited = static_cast<double>(excess_ns) > static_cast<double>(target_ns()) + kJitters * unsteady_ns_;
  if (delay.full_flight_bytes == 0 && !waited) return;
  if (round_.full++ == 0) round_.first_full_ns = now_ns;
  round_.excess_ns = std::min(round_.excess_ns, excess_ns);
  round_.excess_sum_ns += excess_ns;
  const double flight =
      static_cast<double>(std::max(delay.flight_bytes, delay.full_flight_bytes)) * (loss_ > kMuchLoss ? 1 - loss_ : 1);
  round_.flight_bytes += flight;
  round_.rate += flight / away_ns;
}

/// Messages that tell a queue from jitter.
int Pacer::enough() const {
  return 4 * unsteady_ns_ > static_cast<double>(target_ns()) ? kUnsteadyFull : kLeastFull;
}

bool Pacer::is_round_over(std::int64_t now_ns) const {
  if (round_.delays == 0) return false;
  const std::int64_t trip = base_trip_.value();
  if (mode_ == Mode::kStart && round_.full >= kLeastStartFull) return true;
  if (round_.full >= enough() && now_ns - round_.first_full_ns >= std::max(kLeastRound_ns, trip / 4)) return true;
  return now_ns - round_.first_ns >= std::max(kMostRound_ns, trip) * (enough() == kUnsteadyFull ? 16 : 1);
}

void Pacer::note_loss(const SentLog::News& news) {
  for (std::size_t i = 0; i < news.arrived.size(); ++i) loss_ -= kLossMemory * loss_;
  for (std::size_t i = 0; i < news.lost.size(); ++i) loss_ += kLossMemory * (1 - loss_);
}

/// The median of the last pairs. Where they disagree, jitter may have made it, and the link may carry more.
Pacer::PairRate Pacer::pair_rate() const {
  const std::size_t count = std::min(pairs_, pair_rates_.size());
  if (count == 0) return {};
  std::array<double, 16> rates = pair_rates_;
  std::sort(rates.begin(), rates.begin() + count);
  const double low = rates[count / 4], high = rates[count - 1 - count / 4];
  return {rates[count / 2], high < kPairsDisagree * low};
}

/// Pairs tell the link's rate; what the haptic lane takes of it is known here.
double Pacer::free_rate() const {
  return std::max(kFloor, pair_rate().bytes_per_ns - std::max(haptic_fast_, haptic_slow_));
}

void Pacer::on_news(const SentLog::News& news, std::uint64_t next, std::int64_t now_ns) {
  if (!news.is_believed || news.arrived.empty()) return;
  if (silences_ >= 2) {
    // The link was gone. What it carries now need not be what it did.
    window_ = std::max(kMessage, window_ / 2);
    mode_ = Mode::kStart;
    begin_round(next);
  }
  silences_ = 0;
  for (const SentLog::News::Delay& delay : news.delays) note(delay, now_ns);
  if (mode_ == Mode::kStart && overshoots_ >= enough()) {
    // Not even the round is waited for: what was under way under the last window is what the link held.
    const SentLog::News::Delay& last = news.delays.back();
    const double share = (kShare * static_cast<double>(target_ns()) - static_cast<double>(least_overshoot_ns_)) /
                         static_cast<double>(last.away_ns);
    window_ = std::clamp(static_cast<double>(last.flight_bytes) * (1 + share), kMessage, window_);
    leave_start();
    begin_round(next);
  }
  note_loss(news);
  if (mode_ == Mode::kDrain || mode_ == Mode::kAsk) {
    const bool is_over = dip_mark_ != 0 && news.newest >= dip_mark_ + (mode_ == Mode::kAsk ? 2 : 0);
    const bool is_late = now_ns - dip_ns_ > static_cast<std::int64_t>(4 * trip_ns_) + kSlack_ns;
    if (is_over || is_late) {
      end_dip(now_ns);
      begin_round(next);
    }
  } else if (is_round_over(now_ns)) {
    end_round(now_ns);
    begin_round(next);
  }
}

void Pacer::end_round(std::int64_t now_ns) {
  const std::int64_t target = target_ns();
  if (round_.full == 0) return;  // little was sent, and the link was not full: nothing is known
  // The mean excess less its own least is the mean queue, whatever the jitter; the least excess is there in any case.
  const std::int64_t mean_ns = round_.excess_sum_ns / round_.full;
  const bool knows_mean = round_.full >= enough();
  if (knows_mean) jitter_.note(mean_ns, now_ns);
  const bool is_steady = enough() == kLeastFull;
  // Where delays vary, a few in a row may all be long.
  queue_ns_ = is_steady
                  ? round_.excess_ns
                  : std::max<std::int64_t>(0, round_.excess_ns - static_cast<std::int64_t>(kJitters * unsteady_ns_));
  if (knows_mean || is_steady) {
    // The least of many means is less than the mean by some of their own spread.
    const double spread = is_steady ? 0 : kSpreads * unsteady_ns_ / std::sqrt(round_.full);
    queue_ns_ = std::max(queue_ns_, mean_ns - std::min(mean_ns, jitter_.value()) - static_cast<std::int64_t>(spread));
  }
  if (round_.flight_bytes <= kMessage * round_.full && queue_ns_ > target / 4) {
    // One message alone stands in no queue of ours: what it waits for is the path's, or the haptic lane's.
    rebase(base_trip_.value() + round_.excess_ns, base_way_.value() + round_.excess_ns, now_ns);
    queue_ns_ = 0;
  }
  rate_ = round_.rate / round_.full;
  if (queue_ns_ <= target) best_rate_ = std::max(rate_, 0.95 * best_rate_);
  if (mode_ == Mode::kStart && queue_ns_ < target / 2) return grow();
  if (mode_ == Mode::kStart && round_.full < enough()) return;  // one or two that were held up are no queue
  if (mode_ == Mode::kStart) leave_start();
  queued_rounds_ = queue_ns_ > target ? queued_rounds_ + 1 : 0;
  // Where nothing ever waits, the link is wider than was thought.
  calm_rounds_ = kCalm * queue_ns_ < target ? calm_rounds_ + 1 : 0;
  cruise();
  // Where one message more would wait for longer than the target, hardly ever.
  const bool is_narrow =
      is_coarse() && pairs_ >= kFirstPairs && kMessage > 1.5 * static_cast<double>(target) * pair_rate().bytes_per_ns;
  if (calm_rounds_ >= (is_narrow ? kMostPatience : patience_)) {
    mode_ = Mode::kStart;
    fresh_from_ = pairs_;
    is_first_start_ = is_second_ = false;
    start_window_ = window_;
  } else if (queued_rounds_ >= kAskAfter) {
    dip(Mode::kAsk, std::min(kAskWindow, window_ / 2), now_ns);
  } else if (++rounds_ % kDrainEvery == 0) {
    dip(Mode::kDrain, kDrainShare * std::min(rate_ * static_cast<double>(base_trip_.value()), window_), now_ns);
  }
}

void Pacer::rebase(std::int64_t trip_ns, std::int64_t way_ns, std::int64_t now_ns) {
  base_trip_.forget(), base_way_.forget(), jitter_.forget();
  base_trip_.note(trip_ns, now_ns);
  base_way_.note(way_ns, now_ns);
}

void Pacer::leave_start() {
  mode_ = Mode::kCruise;
  // Where it found nothing, it is tried more rarely.
  const bool has_found = is_first_start_ || window_ > kFound * start_window_;
  patience_ = has_found ? kPatience : std::min(4 * patience_, kMostPatience);
  rounds_ = calm_rounds_ = queued_rounds_ = 0;
}

void Pacer::grow() {
  const double way = static_cast<double>(base_trip_.value()) + kShare * static_cast<double>(target_ns());
  const double blind = is_first_start_ ? kStartGain : kLeastGain;
  double most = 1.01 * blind * window_;
  if (pairs_ >= fresh_from_ + kFirstPairs) {
    const double told = kPairShare * free_rate() * way;
    most = pair_rate().is_bound ? told : std::max(told, std::min(most, kBlindRate * way));
  }
  if (loss_ > kMuchLoss) {
    mode_ = Mode::kCruise;
    calm_rounds_ = 0;
    return;
  }
  if (most <= kLeastGain * window_) return leave_start();
  window_ = std::min(kStartGain * window_, most);
}

/// D + B (share target - q), of the round that is over.
void Pacer::cruise() {
  const double flight = round_.flight_bytes / round_.full, target = static_cast<double>(target_ns());
  double window = flight + rate_ * (kShare * target - static_cast<double>(queue_ns_));
  if (loss_ > kMuchLoss) window = std::min(window, flight);
  window_ = std::clamp(window, kMessage, std::max(kMostGain * flight, flight + kMessage));
}

void Pacer::dip(Mode mode, double window, std::int64_t now_ns) {
  mode_ = mode;
  dip_window_ = std::max(window, kMessage);
  dip_mark_ = 0;
  dip_ns_ = now_ns;
  dip_least_ns_ = dip_least_way_ns_ = kNever_ns;
  dip_excess_sum_ns_ = dip_delays_ = 0;
}

void Pacer::end_dip(std::int64_t now_ns) {
  if (dip_delays_ >= kLeastFull) jitter_.note(dip_excess_sum_ns_ / dip_delays_, now_ns);
  if (mode_ == Mode::kAsk && dip_least_ns_ != kNever_ns) {
    const bool is_longer = dip_least_ns_ - base_trip_.value() > target_ns();
    if (is_longer) {
      rebase(dip_least_ns_, dip_least_way_ns_, now_ns);
    }
    // A longer path carries as much as before; a queue that is gone was the link's, whose rate is known from it.
    const double rate = is_longer ? kBackShare * best_rate_ : rate_;
    window_ = std::max(kMessage, rate * static_cast<double>(base_trip_.value()));
    queued_rounds_ = 0;
    mode_ = is_longer ? Mode::kStart : Mode::kCruise;
    is_first_start_ = false;
    start_window_ = window_;
  } else {
    mode_ = Mode::kCruise;
  }
}

void Pacer::on_silence(std::int64_t now_ns) {
  ++silences_;
  next_send_ns_ = std::min(next_send_ns_, now_ns);
}

std::int64_t Pacer::timeout_ns() const {
  if (trip_ns_ <= 0) return kFirstTimeout_ns;
  const std::int64_t once =
      2 * static_cast<std::int64_t>(trip_ns_) + kSlack_ns + std::int64_t{spacing()} * BulkHead::kSpacing_ns;
  return std::min(once << std::min(silences_, 8), std::max(once, kMostTimeout_ns));
}

std::int64_t Pacer::probe_ns() const {
  return 3 * static_cast<std::int64_t>(trip_ns_) / 2 + kProbeSlack_ns + std::int64_t{spacing()} * BulkHead::kSpacing_ns;
}

std::uint8_t Pacer::spacing() const {
  // Sixteen a round trip are plenty.
  return static_cast<std::uint8_t>(std::clamp<std::int64_t>(round_trip_ns() / 16 / BulkHead::kSpacing_ns, 1, 40));
}

void Pacer::on_haptic_bytes(std::uint64_t sent_in_all, std::int64_t now_ns) {
  const auto passed = static_cast<double>(now_ns - haptic_ns_);
  if (haptic_ns_ != 0 && passed < 1e6) return;
  if (haptic_ns_ != 0 && sent_in_all >= haptic_bytes_) {
    const double rate = static_cast<double>(sent_in_all - haptic_bytes_) / passed;
    haptic_fast_ += (rate - haptic_fast_) * (1 - std::exp(-passed / kHapticFast_ns));
    haptic_slow_ += (rate - haptic_slow_) * (1 - std::exp(-passed / std::max(4 * kHapticFast_ns, 2 * trip_ns_)));
  }
  haptic_bytes_ = sent_in_all;
  haptic_ns_ = now_ns;
}

}  // namespace farfeel::transport
