#include "transport/bulk/object_inbox.h"

#include <algorithm>

namespace farfeel::transport {
namespace {

constexpr std::size_t kHashBytes = 128u << 10;  // at a time: about 0.1 ms
constexpr std::size_t kMostAnswers = 64;        // that wait; a peer that offers faster says it again

}  // namespace

ObjectInbox::ObjectInbox(const InboxLimits& limits, std::shared_ptr<ByteBudget> scene)
    : limits_(limits), peer_(std::make_shared<ByteBudget>(limits.peer_bytes)), scene_(std::move(scene)) {
  limits_.object_bytes = std::min(limits_.object_bytes, kMaxObjectBytes);
}

ObjectInbox::Transfer* ObjectInbox::find(std::uint32_t id) {
  for (const auto& transfer : transfers_)
    if (!transfer->is_orphan && transfer->offer.id == id) return transfer.get();
  return nullptr;
}

void ObjectInbox::answer(std::uint32_t id, std::uint32_t slot) {
  for (const ToAnswer& waiting : to_answer_)
    if (waiting.id == id) return;
  if (to_answer_.size() < kMostAnswers) to_answer_.push_back({id, slot, false});
}

void ObjectInbox::settle(Slot& slot, ObjectState state, RefusedBecause reason) {
  slot.state = state;
  slot.reason = reason;
}

void ObjectInbox::on_offer(const ObjectOffer& offer) {
  if (offer.slot < limits_.first_slot) return answer(offer.id, offer.slot);
  auto at = slots_.find(offer.slot);
  if (at == slots_.end()) {
    if (slots_.size() >= limits_.slots) {
      // Slots of earlier sessions go first; what they hold may then be delivered again.
      const auto old =
          std::find_if(slots_.begin(), slots_.end(), [](const auto& s) { return s.second.newest_id == 0; });
      if (old == slots_.end()) return answer(offer.id, offer.slot);
      slots_.erase(old);
    }
    at = slots_.emplace(offer.slot, Slot{}).first;
  }
  Slot& slot = at->second;
  answer(offer.id, offer.slot);
  if (offer.id < slot.newest_id) return;
  const bool is_again = offer.id == slot.newest_id;
  slot.ask = offer.ask;
  // A refusal for want of room may be otherwise by now; all else stands.
  if (is_again && !(slot.state == ObjectState::kRefused && slot.reason == RefusedBecause::kNoRoom)) return;
  slot.newest_id = offer.id;
  // What was there before in this slot is superseded, unless it is the same thing under a newer id.
  for (auto& transfer : transfers_) {
    if (transfer->is_orphan || transfer->offer.slot != offer.slot) continue;
    if (transfer->offer.hash == offer.hash && transfer->offer.size == offer.size) {
      transfer->offer = offer;
      return settle(slot, ObjectState::kReceiving);
    }
    std::swap(transfer, transfers_.back());
    transfers_.pop_back();
    ++counters_.superseded;
    break;
  }
  if (slot.delivered == offer.hash) return settle(slot, ObjectState::kComplete);
  const RefusedBecause reason = begin(offer);
  settle(slot, reason == RefusedBecause::kNothing ? ObjectState::kReceiving : ObjectState::kRefused, reason);
  if (reason != RefusedBecause::kNothing) ++counters_.refused;
}

/// Room for it, if there is, or what an earlier session left of it.
RefusedBecause ObjectInbox::begin(const ObjectOffer& offer) {
  if (offer.size > limits_.object_bytes) return RefusedBecause::kTooLarge;
  for (auto& transfer : transfers_) {
    if (!transfer->is_orphan || transfer->offer.hash != offer.hash || transfer->offer.size != offer.size) continue;
    transfer->offer = offer;
    transfer->is_orphan = false;
    ++counters_.resumed;
    return RefusedBecause::kNothing;
  }
  const auto drop_orphan = [this] {
    const auto orphan = std::find_if(transfers_.begin(), transfers_.end(), [](const auto& t) { return t->is_orphan; });
    if (orphan == transfers_.end()) return false;
    transfers_.erase(orphan);
    return true;
  };
  while (transfers_.size() >= limits_.transfers)
    if (!drop_orphan()) return RefusedBecause::kTooMany;
  ByteReservation reservation(peer_, scene_, offer.size);
  while (!reservation && drop_orphan()) reservation = ByteReservation(peer_, scene_, offer.size);
  if (!reservation) return RefusedBecause::kNoRoom;
  auto transfer = std::make_unique<Transfer>();
  transfer->offer = offer;
  transfer->object = std::make_shared<ObjectBytes>(static_cast<std::size_t>(offer.size), std::move(reservation));
  transfer->has = GranuleMap(granules_of(offer.size));
  transfers_.push_back(std::move(transfer));
  return RefusedBecause::kNothing;
}

void ObjectInbox::on_withdrawal(const ObjectWithdrawal& withdrawal) {
  for (auto& [number, slot] : slots_)
    if (slot.newest_id == withdrawal.id) settle(slot, ObjectState::kGone);
  std::erase_if(transfers_, [&](const auto& t) { return !t->is_orphan && t->offer.id == withdrawal.id; });
  std::erase_if(to_answer_, [&](const ToAnswer& waiting) { return waiting.id == withdrawal.id; });
  if (to_answer_.size() < kMostAnswers) to_answer_.push_back({withdrawal.id, 0, true});
}

void ObjectInbox::on_piece(const ObjectPiece& piece) {
  Transfer* transfer = find(piece.id);
  if (!transfer) return;
  const std::uint64_t begin = std::uint64_t{piece.granule} * kGranuleBytes, end = begin + piece.bytes.size();
  const std::uint64_t size = transfer->offer.size;
  if (end > size || (piece.bytes.size() % kGranuleBytes != 0 && end != size)) return;
  const std::uint32_t last = granules_of(end);
  const std::uint32_t fresh = transfer->has.set(piece.granule, last);
  counters_.repeated_bytes += (last - piece.granule - fresh) * kGranuleBytes;
  // What is here already is not written again: it may be hashed.
  if (fresh == 0) return;
  if (fresh != last - piece.granule && transfer->complete > piece.granule) {
    const std::uint64_t known = std::min<std::uint64_t>(std::uint64_t{transfer->complete} * kGranuleBytes, end);
    const auto rest = piece.bytes.subspan(static_cast<std::size_t>(known - begin));
    std::copy(rest.begin(), rest.end(), transfer->object->bytes().begin() + static_cast<std::ptrdiff_t>(known));
  } else {
    std::copy(piece.bytes.begin(), piece.bytes.end(),
              transfer->object->bytes().begin() + static_cast<std::ptrdiff_t>(begin));
  }
  if (piece.granule <= transfer->complete) transfer->complete = transfer->has.next_unset(transfer->complete);
  hash_on(*transfer);
}

/// True if there is more to hash. The transfer may be gone afterwards.
bool ObjectInbox::hash_on(Transfer& transfer) {
  const auto bytes = std::as_const(*transfer.object).bytes();
  const std::size_t here = std::min(bytes.size(), std::size_t{transfer.complete} * kGranuleBytes);
  const std::size_t now = std::min(here - transfer.hashed, kHashBytes);
  transfer.hasher.add(bytes.subspan(transfer.hashed, now));
  transfer.hashed += now;
  if (transfer.hashed == bytes.size()) {
    finish(transfer.offer.id);
    return false;
  }
  return transfer.hashed < here;
}

void ObjectInbox::finish(std::uint32_t id) {
  const auto at = std::find_if(transfers_.begin(), transfers_.end(),
                               [&](const auto& t) { return !t->is_orphan && t->offer.id == id; });
  Transfer& transfer = **at;
  Slot& slot = slots_[transfer.offer.slot];
  answer(id, transfer.offer.slot);
  if (transfer.hasher.finish() == transfer.offer.hash) {
    slot.delivered = transfer.offer.hash;
    settle(slot, ObjectState::kComplete);
    ready_.push_back({transfer.offer.slot, transfer.offer.hash, std::move(transfer.object)});
    ++counters_.delivered;
    transfers_.erase(at);
    return;
  }
  ++counters_.corrupt;
  if (++transfer.round >= limits_.rounds) {
    settle(slot, ObjectState::kRefused, RefusedBecause::kCorrupt);
    ++counters_.refused;
    transfers_.erase(at);
    return;
  }
  transfer.has.clear();
  transfer.complete = 0;
  transfer.hasher = ObjectHasher();
  transfer.hashed = 0;
}

bool ObjectInbox::has_work() const {
  return std::any_of(transfers_.begin(), transfers_.end(), [](const auto& t) {
    return !t->is_orphan &&
           t->hashed < std::min<std::uint64_t>(t->offer.size, std::uint64_t{t->complete} * kGranuleBytes);
  });
}

bool ObjectInbox::work() {
  for (std::size_t i = 0; i < transfers_.size(); ++i) {
    Transfer& transfer = *transfers_[i];
    if (!transfer.is_orphan && std::size_t{transfer.complete} * kGranuleBytes > transfer.hashed) {
      hash_on(transfer);
      break;
    }
  }
  return has_work();
}

std::optional<ObjectAnswer> ObjectInbox::take_answer() {
  if (to_answer_.empty()) return std::nullopt;
  const ToAnswer to = to_answer_.front();
  to_answer_.pop_front();
  ObjectAnswer answer;
  answer.id = to.id;
  answer.revision = ++revision_;
  answer.state = ObjectState::kGone;
  if (to.is_withdrawn) return answer;
  const auto at = slots_.find(to.slot);
  if (at == slots_.end()) {
    answer.state = ObjectState::kRefused;
    answer.reason = RefusedBecause::kTooMany;
    return answer;
  }
  const Slot& slot = at->second;
  answer.ask = slot.ask;
  if (slot.newest_id != to.id) return answer;
  answer.state = slot.state;
  answer.reason = slot.reason;
  const Transfer* transfer = find(to.id);
  if (answer.state != ObjectState::kReceiving || !transfer) return answer;
  answer.round = transfer->round;
  const GranuleMap& has = transfer->has;
  for (std::uint32_t i = has.next_set(0); i < has.size() && answer.ranges < ObjectAnswer::kMostRanges;) {
    const std::uint32_t end = has.next_unset(i);
    answer.range[answer.ranges++] = {i, end};
    i = has.next_set(end);
  }
  return answer;
}

bool ObjectInbox::is_here(std::uint32_t slot) const {
  const auto at = slots_.find(slot);
  return at != slots_.end() && at->second.newest_id != 0 && at->second.state == ObjectState::kComplete;
}

std::optional<ReceivedObject> ObjectInbox::take_object() {
  if (ready_.empty()) return std::nullopt;
  ReceivedObject object = std::move(ready_.front());
  ready_.pop_front();
  return object;
}

void ObjectInbox::restart() {
  for (auto& transfer : transfers_) transfer->is_orphan = true;
  std::erase_if(slots_, [](const auto& s) { return !s.second.delivered; });
  for (auto& [number, slot] : slots_) slot = {.delivered = slot.delivered};
  to_answer_.clear();
  revision_ = 0;
}

ObjectInbox::Progress ObjectInbox::progress() const {
  Progress progress;
  for (const auto& transfer : transfers_) {
    if (transfer->is_orphan) continue;
    progress.all += transfer->offer.size;
    progress.here +=
        std::min<std::uint64_t>(transfer->offer.size, std::uint64_t{transfer->has.count()} * kGranuleBytes);
  }
  return progress;
}

}  // namespace farfeel::transport
