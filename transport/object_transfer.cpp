#include "transport/object_transfer.h"

#include <algorithm>
#include <limits>

namespace farfeel::transport {
namespace {

// Implementation constants: the other end need not agree on these.
constexpr double kFirstWindow = 32, kLeastWindow = 4, kMostWindow = 512;  // chunks
constexpr std::int64_t kFirstRoundTrip_ns = 20'000'000;                   // until one is measured
constexpr std::int64_t kLeastTimeout_ns = 20'000'000;  // a busy machine may hold an answer for a scheduler's slice
constexpr std::int64_t kMostTimeout_ns = 1'000'000'000;
constexpr std::int64_t kBurst_ns = 250'000;  // chunks due within this leave together: fewer wake-ups
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

std::size_t chunk_size(std::uint64_t object_size, std::uint32_t index) {
  return static_cast<std::size_t>(
      std::min<std::uint64_t>(kChunkBytes, object_size - std::uint64_t{index} * kChunkBytes));
}

}  // namespace

ObjectSender::ObjectSender(std::uint32_t id, std::shared_ptr<const Object> object)
    : id_(id),
      object_(std::move(object)),
      chunks_(chunks_of(object_->bytes.size())),
      window_(kFirstWindow),
      round_trip_ns_(kFirstRoundTrip_ns) {}

Offer ObjectSender::offer() const {
  return {id_, object_->bytes.size(), object_->hash};
}

std::int64_t ObjectSender::timeout_ns() const {
  return std::clamp(3 * round_trip_ns_, kLeastTimeout_ns, kMostTimeout_ns);
}

void ObjectSender::mark_arrived(std::uint32_t begin, std::uint32_t end) {
  for (std::uint32_t i = begin; i < end; ++i) {
    ChunkState& chunk = chunks_[i];
    if (chunk.has_arrived) continue;
    chunk.has_arrived = true;
    ++arrived_;
    if (!chunk.is_resent && chunk.send_order > newest_arrived_order_) {
      newest_arrived_order_ = chunk.send_order;
      newest_arrived_sent_ns_ = chunk.sent_ns;
    }
    if (chunk.sent_ns != 0) window_ = std::min(window_ + 1, kMostWindow);
  }
}

void ObjectSender::mark_lost(std::uint32_t index, std::int64_t now_ns) {
  chunks_[index].sent_ns = 0;
  chunks_[index].is_resent = true;
  lost_.push_back(index);
  if (now_ns - last_cut_ns_ < round_trip_ns_) return;
  last_cut_ns_ = now_ns;
  window_ = std::max(window_ / 2, kLeastWindow);
}

void ObjectSender::find_lost(std::int64_t now_ns) {
  std::size_t kept = 0;
  for (const std::uint32_t index : in_flight_) {
    const ChunkState& chunk = chunks_[index];
    if (chunk.has_arrived) continue;
    const bool is_overtaken = chunk.send_order + kReorderTolerance < newest_arrived_order_ &&
                              chunk.sent_ns + round_trip_ns_ / 4 < newest_arrived_sent_ns_;
    if (is_overtaken || now_ns - chunk.sent_ns > timeout_ns()) {
      mark_lost(index, now_ns);
    } else {
      in_flight_[kept++] = index;
    }
  }
  in_flight_.resize(kept);
}

void ObjectSender::on_acknowledge(const Acknowledge& ack, std::int64_t now_ns) {
  const std::uint32_t end = ack.ranges == 0 ? ack.complete : ack.range[ack.ranges - 1].end;
  if (ack.object != id_ || end > chunks_.size()) return;
  is_wanted_ = true;
  if (const std::int64_t trip = now_ns - ack.t_echo_ns - std::int64_t{ack.hold_us} * 1000;
      ack.t_echo_ns > 0 && trip > 0 && trip < kMostTimeout_ns) {
    round_trip_ns_ = has_round_trip_ ? (7 * round_trip_ns_ + trip) / 8 : trip;
    has_round_trip_ = true;
  }
  mark_arrived(complete_, ack.complete);
  complete_ = std::max(complete_, ack.complete);
  for (std::size_t i = 0; i < ack.ranges; ++i) mark_arrived(ack.range[i].begin, ack.range[i].end);
  find_lost(now_ns);
}

std::optional<Chunk> ObjectSender::next_chunk(std::int64_t now_ns) {
  if (!is_wanted_ || is_complete()) return std::nullopt;
  find_lost(now_ns);
  if (static_cast<double>(in_flight_.size()) >= window_ || next_send_ns_ > now_ns + kBurst_ns) return std::nullopt;
  std::uint32_t index = 0;
  while (!lost_.empty() && chunks_[lost_.back()].has_arrived) lost_.pop_back();
  if (!lost_.empty()) {
    index = lost_.back();
    lost_.pop_back();
    ++resent_;
  } else {
    while (next_ < chunks_.size() && chunks_[next_].has_arrived) ++next_;  // a resumed transfer
    if (next_ == chunks_.size()) return std::nullopt;
    index = next_++;
  }
  chunks_[index].sent_ns = now_ns;
  chunks_[index].send_order = ++sendings_;
  in_flight_.push_back(index);
  const auto spacing_ns = static_cast<std::int64_t>(static_cast<double>(round_trip_ns_) / window_);
  // A sender that is woken late catches up with half a round trip's worth at once; the window bounds the rest.
  next_send_ns_ = std::max(next_send_ns_, now_ns - round_trip_ns_ / 2) + spacing_ns;
  const std::size_t at = std::size_t{index} * kChunkBytes;
  return Chunk{id_, index, now_ns, std::span(object_->bytes).subspan(at, chunk_size(object_->bytes.size(), index))};
}

std::int64_t ObjectSender::next_time_ns(std::int64_t now_ns) const {
  if (!is_wanted_ || is_complete()) return kNever;
  const std::int64_t timeout = in_flight_.empty() ? kNever : chunks_[in_flight_.front()].sent_ns + timeout_ns();
  const bool has_room = static_cast<double>(in_flight_.size()) < window_;
  const bool has_work = !lost_.empty() || next_ < chunks_.size();
  return std::min(timeout, has_room && has_work ? std::max(now_ns, next_send_ns_ - kBurst_ns / 2) : kNever);
}

void ObjectReceiver::start(const Offer& offer) {
  bytes_.assign(static_cast<std::size_t>(offer.size), std::byte{0});
  has_.assign(chunks_of(offer.size), false);
  received_ = complete_ = end_ = 0;
  newest_t_send_ns_ = newest_arrival_ns_ = 0;
}

void ObjectReceiver::on_offer(const Offer& offer) {
  const bool is_same = has_offer_ && offer.hash == offer_.hash && offer.size == offer_.size;
  if (!is_same) start(offer);
  if (!is_same || offer.object != offer_.object) newest_t_send_ns_ = 0;  // another session's clock may be another
  offer_ = offer;
  has_offer_ = true;
}

bool ObjectReceiver::on_chunk(const Chunk& chunk, std::int64_t now_ns) {
  if (!has_offer_ || chunk.object != offer_.object || chunk.index >= has_.size()) return false;
  if (chunk.bytes.size() != chunk_size(offer_.size, chunk.index)) return false;
  newest_t_send_ns_ = chunk.t_send_ns;
  newest_arrival_ns_ = now_ns;
  if (has_[chunk.index]) return false;
  has_[chunk.index] = true;
  ++received_;
  end_ = std::max(end_, chunk.index + 1);
  std::copy(chunk.bytes.begin(), chunk.bytes.end(), bytes_.begin() + std::ptrdiff_t{chunk.index} * kChunkBytes);
  while (complete_ < has_.size() && has_[complete_]) ++complete_;
  if (complete_ < has_.size()) return true;
  if (hash_of(bytes_) == offer_.hash) {
    object_ = std::make_shared<const Object>(Object{offer_.hash, std::move(bytes_)});
    bytes_ = {};
  } else {
    ++corrupt_;
    start(offer_);
  }
  return true;
}

Acknowledge ObjectReceiver::acknowledge(std::int64_t now_ns) const {
  Acknowledge ack;
  ack.object = offer_.object;
  ack.complete = complete_;
  ack.t_echo_ns = newest_t_send_ns_;
  if (newest_t_send_ns_ != 0) {
    const std::int64_t hold_us = (now_ns - newest_arrival_ns_) / 1000;
    ack.hold_us = static_cast<std::uint32_t>(std::clamp<std::int64_t>(hold_us, 0, 0xFFFF'FFFF));
  }
  for (std::uint32_t i = complete_ + 1; i < end_ && ack.ranges < Acknowledge::kMaxRanges;) {
    if (!has_[i]) {
      ++i;
      continue;
    }
    const std::uint32_t begin = i;
    while (i < end_ && has_[i]) ++i;
    ack.range[ack.ranges++] = {begin, i};
  }
  return ack;
}

double ObjectReceiver::progress() const {
  return has_.empty() ? 0.0 : static_cast<double>(received_) / static_cast<double>(has_.size());
}

}  // namespace farfeel::transport
