#include "transport/bulk/receipt_log.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kMostSpacing_ns = 25'000'000;  // however rarely a sender wants to hear
constexpr std::uint64_t kFirst = 1ull << 32;          // so that numbers around the first one never go below zero

}  // namespace

bool ReceiptLog::note(const BulkHead& head, std::int64_t arrival_ns) {
  const std::uint64_t number = widened(head.number, has_any_ ? newest_ : kFirst + head.number);
  const bool is_newest = !has_any_ || number > newest_;
  if (!insert(number)) return false;
  if (is_newest) {
    newest_ = number;
    newest_arrival_ns_ = arrival_ns;
    newest_t_send_us_ = head.t_send_us;
    spacing_ns_ = std::min(std::max<std::int64_t>(1, head.spacing) * BulkHead::kSpacing_ns, kMostSpacing_ns);
  }
  has_any_ = true;
  arrivals_[arrival_count_++ % arrivals_.size()] = {number, arrival_ns};
  return true;
}

bool ReceiptLog::insert(std::uint64_t number) {
  if (number < forgotten_) return false;
  std::size_t at = 0;  // the first range that does not lie wholly above the number and apart from it
  while (at < range_count_ && ranges_[at].begin > number + 1) ++at;
  if (at < range_count_) {
    Range& range = ranges_[at];
    if (range.begin <= number && number < range.end) return false;
    if (number == range.end) {
      ++range.end;
      return true;  // were the range above adjacent, `at` would be that one
    }
    if (number + 1 == range.begin) {
      --range.begin;
      if (at + 1 < range_count_ && ranges_[at + 1].end == range.begin) {
        range.begin = ranges_[at + 1].begin;
        std::copy(ranges_.begin() + at + 2, ranges_.begin() + range_count_, ranges_.begin() + at + 1);
        --range_count_;
      }
      return true;
    }
  }
  if (at == ranges_.size()) {
    forgotten_ = number + 1;  // older than all that can be told
    return false;
  }
  if (range_count_ == ranges_.size()) forgotten_ = ranges_[--range_count_].end;
  std::copy_backward(ranges_.begin() + at, ranges_.begin() + range_count_, ranges_.begin() + range_count_ + 1);
  ranges_[at] = {number, number + 1};
  ++range_count_;
  return true;
}

std::int64_t ReceiptLog::next_time_ns() const {
  if (arrival_count_ == 0) return kNever_ns;
  return reported_ns_ + spacing_ns_;
}

std::optional<Receipt> ReceiptLog::take_due(std::int64_t now_ns) {
  if (now_ns < next_time_ns()) return std::nullopt;
  constexpr std::uint64_t kMostLength = std::numeric_limits<std::uint16_t>::max();
  Receipt receipt;
  receipt.newest = static_cast<std::uint32_t>(newest_);
  receipt.echo_us = newest_t_send_us_;
  receipt.arrival_us = static_cast<std::uint32_t>(newest_arrival_ns_ / 1000);
  receipt.hold_us = static_cast<std::uint32_t>(
      std::clamp<std::int64_t>((now_ns - newest_arrival_ns_) / 1000, 0, std::numeric_limits<std::uint32_t>::max()));
  for (std::size_t i = 0; i < range_count_; ++i) {
    const std::uint64_t gap = i == 0 ? 0 : ranges_[i - 1].begin - ranges_[i].end;
    const std::uint64_t length = ranges_[i].end - ranges_[i].begin;
    if (gap > kMostLength) break;
    receipt.range[receipt.ranges++] = {static_cast<std::uint16_t>(gap),
                                       static_cast<std::uint16_t>(std::min(length, kMostLength))};
    if (length > kMostLength) break;  // what lies below was in thousands of receipts
  }
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(arrival_count_, arrivals_.size()); ++i) {
    const Arrival& arrival = arrivals_[i];
    const std::uint64_t back = newest_ - arrival.number;
    const std::int64_t earlier_us = newest_arrival_ns_ / 1000 - arrival.arrival_ns / 1000;
    if (back == 0 || back > 0xFF || earlier_us < -0x8000 || earlier_us > 0x7FFF) continue;
    receipt.stamp[receipt.stamps++] = {static_cast<std::uint8_t>(back), static_cast<std::int16_t>(earlier_us)};
  }
  arrival_count_ = 0;
  reported_ns_ = now_ns;
  return receipt;
}

}  // namespace farfeel::transport
