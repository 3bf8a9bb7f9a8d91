#include "transport/bulk/object_outbox.h"

#include <algorithm>

namespace farfeel::transport {
namespace {

// A statement is said again after a round trip and some, then ever more rarely.
constexpr std::int64_t kLeastPause_ns = 20'000'000, kMostPause_ns = 1'000'000'000;
constexpr std::size_t kMostWithdrawn = 64;               // at once, because a receiver names them
constexpr std::int64_t kNoRoomPause_ns = 1'000'000'000;  // until a receiver without room is asked again

// A tag: id in the upper half; granules' count (at most 2^7) and begin (at most 2^22) in the lower.
constexpr std::uint32_t kBeginBits = 23;
static_assert(kMaxObjectBytes / kGranuleBytes < (1u << kBeginBits) && kMostMessageBytes / kGranuleBytes < (1u << 9));

std::uint64_t tag_of(std::uint32_t id, std::uint32_t begin, std::uint32_t count) {
  return std::uint64_t{id} << 32 | count << kBeginBits | begin;
}

}  // namespace

ObjectOutbox::Outgoing* ObjectOutbox::find(std::uint32_t id) {
  const auto at = std::find_if(outgoing_.begin(), outgoing_.end(), [&](const Outgoing& o) { return o.id == id; });
  return at == outgoing_.end() ? nullptr : &*at;
}

const ObjectOutbox::Outgoing* ObjectOutbox::in_slot(std::uint32_t slot) const {
  const auto at = std::find_if(outgoing_.begin(), outgoing_.end(), [&](const Outgoing& o) { return o.slot == slot; });
  return at == outgoing_.end() ? nullptr : &*at;
}

void ObjectOutbox::start(Outgoing& out, std::int64_t now_ns) {
  out.status = Status::kOffered;
  out.reason = RefusedBecause::kNothing;
  out.arrived = {};
  out.lost.clear();
  out.next = out.in_flight = out.revision = 0;
  out.round = 0;
  out.ask = 0;
  out.has_asked_whole = false;
  out.say_ns = now_ns;
  out.pause_ns = 0;
}

void ObjectOutbox::offer(std::uint32_t slot, std::shared_ptr<const Object> object, std::uint8_t urgency,
                         std::int64_t now_ns) {
  auto* out = const_cast<Outgoing*>(in_slot(slot));
  if (out && out->object->hash == object->hash) {
    out->urgency = urgency;
    return;
  }
  if (out) {
    if (out->status != Status::kComplete) ++counters_.superseded;
  } else {
    out = &outgoing_.emplace_back();
  }
  out->id = ++last_id_;
  out->slot = slot;
  out->urgency = urgency;
  out->object = std::move(object);
  start(*out, now_ns);
}

void ObjectOutbox::withdraw(std::uint32_t slot, std::int64_t now_ns) {
  const Outgoing* out = in_slot(slot);
  if (!out) return;
  withdrawn_.push_back({out->id, now_ns, 0});
  outgoing_.erase(outgoing_.begin() + (out - outgoing_.data()));
}

void ObjectOutbox::restart(std::int64_t now_ns) {
  last_id_ = 0;
  withdrawn_.clear();
  for (Outgoing& out : outgoing_) {
    out.id = ++last_id_;
    start(out, now_ns);
  }
}

void ObjectOutbox::fill_in(Outgoing& out, const ObjectAnswer& answer) {
  for (std::size_t i = 0; i < answer.ranges; ++i) out.arrived.set(answer.range[i].begin, answer.range[i].end);
}

void ObjectOutbox::on_answer(const ObjectAnswer& answer, std::int64_t now_ns) {
  if (answer.state == ObjectState::kGone)
    std::erase_if(withdrawn_, [&](const Withdrawn& w) { return w.id == answer.id; });
  Outgoing* out = find(answer.id);
  if (!out && answer.state == ObjectState::kReceiving) forget_there(answer.id, now_ns);
  if (!out || answer.revision <= out->revision || out->status == Status::kComplete) return;
  const std::uint32_t granules = granules_of(out->object->bytes.size());
  if (answer.ranges > 0 && answer.range[answer.ranges - 1].end > granules) return;
  out->revision = answer.revision;
  out->reason = answer.reason;
  const bool answers_this = answer.ask == out->ask;
  switch (answer.state) {
    case ObjectState::kComplete:
      out->status = Status::kComplete;
      out->arrived = {};
      out->lost.clear();
      out->say_ns = kNever_ns;
      ++counters_.completed;
      return;
    case ObjectState::kGone:
    case ObjectState::kRefused:
      if (!answers_this && answer.reason == RefusedBecause::kNoRoom) return;
      out->status = Status::kRefused;
      // Room may come; nothing else changes by itself.
      out->say_ns = answer.reason == RefusedBecause::kNoRoom ? now_ns + kNoRoomPause_ns : kNever_ns;
      return;
    case ObjectState::kReceiving:
      break;
  }
  const bool is_first = out->status != Status::kSending;
  const bool starts_over = is_first || answer.round != out->round;
  if (starts_over || (out->has_asked_whole && answers_this)) {
    // It says itself what it has, and nothing is on its way.
    out->arrived = GranuleMap(granules);
    out->lost.clear();
    out->next = 0;
  }
  if (answer.round > out->round) ++counters_.restarted;
  out->status = Status::kSending;
  out->round = answer.round;
  out->say_ns = kNever_ns;
  out->has_asked_whole = false;
  fill_in(*out, answer);
  ask_if_whole(*out, now_ns);
}

/// An offer that came after its own withdrawal has begun a transfer which nobody serves.
void ObjectOutbox::forget_there(std::uint32_t id, std::int64_t now_ns) {
  const bool is_said = std::any_of(withdrawn_.begin(), withdrawn_.end(), [&](const auto& w) { return w.id == id; });
  if (!is_said && withdrawn_.size() < kMostWithdrawn) withdrawn_.push_back({id, now_ns, 0});
}

void ObjectOutbox::ask_if_whole(Outgoing& out, std::int64_t now_ns) {
  if (out.status != Status::kSending || !out.arrived.is_full() || out.has_asked_whole) return;
  // It is about to say so by itself: a round trip's patience, then ask.
  out.has_asked_whole = true;
  ++out.ask;
  out.pause_ns = 0;
  out.say_ns = now_ns + kLeastPause_ns;
}

std::span<const std::byte> ObjectOutbox::next_statement(std::span<std::byte> to, std::int64_t round_trip_ns,
                                                        std::int64_t now_ns) {
  const auto later = [&](std::int64_t& pause_ns) {
    pause_ns = std::clamp(2 * pause_ns, std::max(kLeastPause_ns, round_trip_ns + round_trip_ns / 2), kMostPause_ns);
    return now_ns + pause_ns;
  };
  for (Withdrawn& withdrawn : withdrawn_) {
    if (withdrawn.say_ns > now_ns) continue;
    withdrawn.say_ns = later(withdrawn.pause_ns);
    return write(ObjectWithdrawal{withdrawn.id}, to);
  }
  for (Outgoing& out : outgoing_) {
    if (out.say_ns > now_ns) continue;
    out.say_ns = later(out.pause_ns);
    if (out.status == Status::kRefused) out.status = Status::kOffered;
    if (!out.has_asked_whole) ++out.ask;
    return write(ObjectOffer{out.id, out.slot, out.ask, out.object->bytes.size(), out.object->hash}, to);
  }
  return {};
}

std::int64_t ObjectOutbox::next_statement_ns() const {
  std::int64_t at = kNever_ns;
  for (const Withdrawn& withdrawn : withdrawn_) at = std::min(at, withdrawn.say_ns);
  for (const Outgoing& out : outgoing_) at = std::min(at, out.say_ns);
  return at;
}

bool ObjectOutbox::has_piece(Outgoing& out) {
  if (out.status != Status::kSending) return false;
  while (!out.lost.empty()) {
    Range& lost = out.lost.front();
    lost.begin = out.arrived.next_unset(lost.begin);
    if (lost.begin < lost.end) return true;
    out.lost.pop_front();
  }
  out.next = out.arrived.next_unset(out.next);
  return out.next < out.arrived.size();
}

ObjectOutbox::Outgoing* ObjectOutbox::most_urgent() {
  Outgoing* best = nullptr;
  for (Outgoing& out : outgoing_) {
    const bool is_better = !best || out.urgency < best->urgency || (out.urgency == best->urgency && out.id < best->id);
    if (is_better && has_piece(out)) best = &out;
  }
  return best;
}

std::optional<std::uint8_t> ObjectOutbox::urgency(std::int64_t) {
  const Outgoing* out = most_urgent();
  return out ? std::optional(out->urgency) : std::nullopt;
}

std::optional<BulkSource::Item> ObjectOutbox::next(std::span<std::byte> to, std::int64_t) {
  Outgoing* out = most_urgent();
  if (!out || to.size() < ObjectPiece::kBytes + kGranuleBytes) return std::nullopt;
  const auto most = static_cast<std::uint32_t>((to.size() - ObjectPiece::kBytes) / kGranuleBytes);
  const bool is_again = !out->lost.empty();
  const std::uint32_t begin = is_again ? out->lost.front().begin : out->next;
  const std::uint32_t limit = is_again ? out->lost.front().end : out->arrived.size();
  const std::uint32_t end = std::min({begin + most, limit, out->arrived.next_set(begin)});
  if (is_again) {
    out->lost.front().begin = end;
  } else {
    out->next = end;
  }
  const auto& bytes = out->object->bytes;
  const std::size_t at = std::size_t{begin} * kGranuleBytes;
  const std::size_t size = std::min(bytes.size(), std::size_t{end} * kGranuleBytes) - at;
  const auto written = write(ObjectPiece{out->id, begin, std::span(bytes).subspan(at, size)}, to);
  ++out->in_flight;
  counters_.sent_bytes += size;
  if (is_again) counters_.resent_bytes += size;
  return Item{BulkType::kObjectPiece, written.size(), tag_of(out->id, begin, end - begin)};
}

void ObjectOutbox::on_arrived(std::uint64_t tag, std::int64_t now_ns) {
  Outgoing* out = find(static_cast<std::uint32_t>(tag >> 32));
  if (!out || out->status != Status::kSending) return;
  const auto low = static_cast<std::uint32_t>(tag);
  const std::uint32_t begin = low & ((1u << kBeginBits) - 1), count = low >> kBeginBits;
  out->arrived.set(begin, begin + count);
  ask_if_whole(*out, now_ns);
}

void ObjectOutbox::on_lost(std::uint64_t tag, std::int64_t) {
  Outgoing* out = find(static_cast<std::uint32_t>(tag >> 32));
  if (!out || out->status != Status::kSending) return;
  const auto low = static_cast<std::uint32_t>(tag);
  const std::uint32_t begin = low & ((1u << kBeginBits) - 1), count = low >> kBeginBits;
  out->lost.push_back({begin, begin + count});
}

ObjectOutbox::Status ObjectOutbox::status(std::uint32_t slot) const {
  const Outgoing* out = in_slot(slot);
  return out ? out->status : Status::kNone;
}

RefusedBecause ObjectOutbox::reason(std::uint32_t slot) const {
  const Outgoing* out = in_slot(slot);
  return out ? out->reason : RefusedBecause::kNothing;
}

}  // namespace farfeel::transport
