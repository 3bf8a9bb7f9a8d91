#include "transport/bulk/sent_log.h"

#include <algorithm>

#include "transport/bulk/receipt_log.h"

namespace farfeel::transport {
namespace {

constexpr std::uint64_t kFirst = 1ull << 32;  // numbers near the first one never go below zero
constexpr std::uint64_t kMostSkip = 64;       // between numbers that are not used; 32 on average
// Networks deliver within a few milliseconds of the order; more is learnt.
constexpr std::int64_t kLeastReorder_ns = 1'000'000, kMostReorder_ns = 100'000'000;
constexpr std::int64_t kReorderDecay = 2'000;     // of the window's excess, a message that arrives in order
constexpr std::size_t kKept = 256;                // messages behind those in flight, at least,
constexpr std::int64_t kKept_ns = 1'000'000'000;  // and for so long: they may yet arrive
constexpr std::size_t kMostKept = 65'536;

}  // namespace

SentLog::SentLog(std::uint64_t seed, std::uint64_t first)
    : random_(seed), first_(kFirst + first), next_(first_), open_(first_), reorder_ns_(kLeastReorder_ns) {
  skip_ = next_ + 1 + random_() % kMostSkip;
}

BulkHead SentLog::next_head(BulkType type, std::uint8_t spacing, std::int64_t now_ns) {
  if (next_ == skip_) {
    log_.push_back({});
    log_.back().state = Message::State::kSkipped;
    log_.back().sent_ns = now_ns;
    ++next_;
    skip_ = next_ + 1 + random_() % kMostSkip;
  }
  return {static_cast<std::uint8_t>(type), static_cast<std::uint32_t>(next_), static_cast<std::uint32_t>(now_ns / 1000),
          spacing};
}

void SentLog::add(const BulkHead& head, const Message& message) {
  log_.push_back(message);
  log_.back().t_send_us = head.t_send_us;
  log_.back().state = Message::State::kSent;
  in_flight_bytes_ += message.bytes;
  log_.back().flight_bytes = in_flight_bytes_;
  ++next_;
}

SentLog::Message* SentLog::find(std::uint64_t number) {
  return number < first_ || number >= next_ ? nullptr : &log_[static_cast<std::size_t>(number - first_)];
}

std::int64_t SentLog::oldest_in_flight_ns() const {
  for (std::uint64_t n = open_; n < next_; ++n) {
    const Message& message = log_[static_cast<std::size_t>(n - first_)];
    if (message.state == Message::State::kSent) return message.sent_ns;
  }
  return kNever_ns;
}

bool SentLog::is_credible(const Receipt& receipt) {
  const std::uint64_t newest = widened(receipt.newest, next_);
  if (newest >= next_) has_lied_ = true;
  const Message* message = find(newest);
  if (!message) return false;
  if (message->state == Message::State::kSkipped) has_lied_ = true;
  if (message->state == Message::State::kSkipped || message->t_send_us != receipt.echo_us) return false;
  std::uint64_t end = newest + 1;
  for (std::size_t i = 0; i < receipt.ranges; ++i) {
    end -= receipt.range[i].gap;
    for (std::uint64_t n = end; n > end - receipt.range[i].length;) {
      const Message* claimed = find(--n);
      if (!claimed) break;  // forgotten, and what is below as well
      if (claimed->state == Message::State::kSkipped) has_lied_ = true;
      if (claimed->state == Message::State::kSkipped) return false;
      if (claimed->state == Message::State::kArrived) n -= std::min<std::uint64_t>(n, claimed->run);
    }
    end -= receipt.range[i].length;
  }
  return true;
}

const SentLog::News& SentLog::on_receipt(const Receipt& receipt, std::int64_t now_ns) {
  news_ = {};
  if (has_lied_ || !is_credible(receipt)) {
    ++disbelieved_;
    return news_;
  }
  news_.is_believed = true;
  const std::uint64_t newest = widened(receipt.newest, next_);
  Message& first = *find(newest);
  const bool is_new = first.state != Message::State::kArrived;
  std::uint64_t end = newest + 1;
  for (std::size_t i = 0; i < receipt.ranges; ++i) {
    end -= receipt.range[i].gap;
    take_range(end - receipt.range[i].length, end, now_ns);
    end -= receipt.range[i].length;
  }
  newest_arrived_ = std::max(newest_arrived_, newest);
  news_.newest = newest_arrived_;
  // Stamps: each message's own delays, in the order of sending.
  const std::int64_t back_ns = now_ns - std::int64_t{receipt.hold_us} * 1000;  // when the newest's answer set out, here
  const auto stamp = [&](std::uint64_t number, std::int64_t earlier_us) {
    Message* message = find(number);
    if (!message || message->state != Message::State::kArrived) return;
    message->arrival_us = receipt.arrival_us - static_cast<std::uint32_t>(earlier_us);
    message->has_stamp = true;
  };
  const auto note = [&](std::uint64_t number, std::int64_t earlier_us) {
    const Message* message = find(number);
    if (!message || !message->has_stamp) return;
    const std::int64_t round_trip_ns = back_ns - earlier_us * 1000 - message->sent_ns;
    if (round_trip_ns <= 0) return;  // it held it for longer than it was away
    const auto since = [&](std::uint32_t then_us) {
      return std::int64_t{static_cast<std::int32_t>(message->arrival_us - then_us)} * 1000;
    };
    const Message* before = message->follows ? find(number - 1) : nullptr;
    const std::int64_t interval_ns = before && before->has_stamp ? since(before->arrival_us) : 0;
    news_.delays.push_back({number, round_trip_ns, now_ns - message->sent_ns, since(message->t_send_us),
                            std::max<std::int64_t>(0, interval_ns), message->flight_bytes, message->full_flight_bytes,
                            message->bytes});
  };
  // A stamp that says -earlier is later: all are known before the first is used.
  if (is_new) stamp(newest, 0);
  for (std::size_t i = 0; i < receipt.stamps; ++i) stamp(newest - receipt.stamp[i].back, receipt.stamp[i].earlier_us);
  for (std::size_t i = 0; i < receipt.stamps; ++i) note(newest - receipt.stamp[i].back, receipt.stamp[i].earlier_us);
  if (is_new) note(newest, 0);
  if (!news_.delays.empty()) round_trip_ns_ = news_.delays.back().round_trip_ns;
  find_lost();
  forget();
  return news_;
}

void SentLog::take_range(std::uint64_t begin, std::uint64_t end, std::int64_t now_ns) {
  for (std::uint64_t n = end; n > begin;) {
    Message* message = find(--n);
    if (!message) return;
    if (message->state == Message::State::kArrived) {
      n -= std::min<std::uint64_t>(n, message->run);
      continue;
    }
    const bool was_lost = message->state == Message::State::kLost;
    if (was_lost) {
      // It was late, not lost: by how much the order was off is known now.
      ++late_;
      const std::int64_t off_ns = newest_sent_ns_ - message->sent_ns;
      reorder_ns_ = std::clamp(std::max(reorder_ns_, off_ns + off_ns / 4), kLeastReorder_ns, kMostReorder_ns);
    } else {
      in_flight_bytes_ -= message->bytes;
      reorder_ns_ -= (reorder_ns_ - kLeastReorder_ns) / kReorderDecay;
    }
    arrived_bytes_ += message->bytes;
    message->state = Message::State::kArrived;
    message->run = static_cast<std::uint32_t>(std::min<std::uint64_t>(n - begin, 0xFFFF'FFFF));
    newest_sent_ns_ = std::max(newest_sent_ns_, message->sent_ns);
    news_.arrived.push_back({message->tag, message->source, message->bytes, message->is_large, was_lost});
  }
  (void)now_ns;
}

void SentLog::lose(Message& message) {
  message.state = Message::State::kLost;
  in_flight_bytes_ -= message.bytes;
  news_.lost.push_back({message.tag, message.source, message.bytes, message.is_large, false});
}

void SentLog::find_lost() {
  for (std::uint64_t n = open_; n < newest_arrived_; ++n) {
    Message& message = *find(n);
    if (message.state == Message::State::kSent) {
      if (message.sent_ns + reorder_window_ns() > newest_sent_ns_) return;
      lose(message);
    }
    open_ = n + 1;
  }
}

const SentLog::News& SentLog::on_silence(std::int64_t before_ns) {
  news_ = {};
  for (std::uint64_t n = open_; n < next_; ++n) {
    Message& message = *find(n);
    if (message.state == Message::State::kSent && message.sent_ns <= before_ns) lose(message);
  }
  return news_;
}

void SentLog::forget() {
  while (open_ < next_ && find(open_)->state != Message::State::kSent) ++open_;
  while (log_.size() > kKept && first_ + kKept < open_ &&
         (log_.front().sent_ns + kKept_ns < newest_sent_ns_ || log_.size() > kMostKept)) {
    log_.pop_front();
    ++first_;
  }
}

}  // namespace farfeel::transport
