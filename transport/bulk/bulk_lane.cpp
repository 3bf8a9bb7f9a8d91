#include "transport/bulk/bulk_lane.h"

#include <algorithm>

namespace farfeel::transport {
namespace {

constexpr std::int64_t kTogether_ns = 50'000;  // apart at most, two messages have left together
constexpr std::int64_t kFollowSpare = 4;       // a quarter of the window: round trips vary
constexpr std::size_t kFollowerBytes = 1;      // of padding
// Losses come in bursts, and a quiet lane's next message is in the same one: of bursts of five messages on average, as
// the goals have them, two in three end before the sixth. What outlasts them waits for the silence.
constexpr int kMostFollowers = 6;
constexpr std::uint32_t kNoSource = 0xFFFF'FFFF;

}  // namespace

BulkLane::BulkLane(const BulkOptions& options, std::shared_ptr<ByteBudget> scene)
    : overhead_bytes_(options.overhead_bytes),
      inbox_(options.inbox, std::move(scene)),
      sent_(options.seed, options.first_number),
      path_limit_(options.most_datagram_bytes),
      sources_{&outbox_} {}

void BulkLane::add_source(BulkSource& source) {
  sources_.push_back(&source);
}

void BulkLane::restart(std::uint64_t seed, std::int64_t round_trip_ns, std::int64_t now_ns) {
  outbox_.restart(now_ns);
  inbox_.restart();
  receipts_.restart();
  sent_ = SentLog(seed);
  heard_ns_ = now_ns;
  on_new_path(round_trip_ns);
}

void BulkLane::on_new_path(std::int64_t round_trip_ns) {
  pacer_.restart(round_trip_ns);
  path_limit_.restart();
}

std::optional<BulkLane::Body> BulkLane::on_message(std::span<const std::byte> message, std::int64_t arrival_ns) {
  ++counters_.received;
  const auto type = message.empty() ? BulkType{} : static_cast<BulkType>(message[0]);
  if (const auto head = read_bulk_head(message)) {
    const auto body = message.subspan(BulkHead::kBytes);
    const auto piece = type == BulkType::kObjectPiece ? read_object_piece(body) : std::nullopt;
    if (type == BulkType::kObjectPiece && !piece) {
      ++counters_.malformed;
      return std::nullopt;
    }
    if (!receipts_.note(*head, arrival_ns)) {
      ++counters_.repeated;
      return std::nullopt;
    }
    if (piece) inbox_.on_piece(*piece);
    if (piece || type == BulkType::kPadding) return std::nullopt;
    return Body{type, body};
  }
  if (const auto receipt = read_receipt(message)) {
    tell(sent_.on_receipt(*receipt, arrival_ns), arrival_ns);
  } else if (const auto offer = read_object_offer(message)) {
    inbox_.on_offer(*offer);
  } else if (const auto answer = read_object_answer(message)) {
    outbox_.on_answer(*answer, arrival_ns);
  } else if (const auto withdrawal = read_object_withdrawal(message)) {
    inbox_.on_withdrawal(*withdrawal);
  } else {
    ++counters_.malformed;
  }
  return std::nullopt;
}

void BulkLane::tell(const SentLog::News& news, std::int64_t now_ns) {
  if (news.is_believed && !news.arrived.empty()) heard_ns_ = std::max(heard_ns_, now_ns), has_probed_ = false;
  counters_.arrived += news.arrived.size();
  counters_.lost += news.lost.size();
  for (const SentLog::News::Fate& fate : news.arrived) {
    path_limit_.on_arrived(fate.is_large);
    if (fate.source < sources_.size()) sources_[fate.source]->on_arrived(fate.tag, now_ns);
  }
  for (const SentLog::News::Fate& fate : news.lost) {
    path_limit_.on_lost(fate.is_large, now_ns);
    if (fate.source < sources_.size()) sources_[fate.source]->on_lost(fate.tag, now_ns);
  }
  pacer_.on_news(news, sent_.next_number(), now_ns);
}

void BulkLane::check_silence(std::int64_t now_ns) {
  if (sent_.in_flight_bytes() == 0) return;
  if (now_ns < quiet_since_ns() + pacer_.timeout_ns()) return;
  ++counters_.silences;
  heard_ns_ = now_ns;
  pacer_.on_silence(now_ns);
  tell(sent_.on_silence(now_ns), now_ns);
}

std::int64_t BulkLane::quiet_since_ns() const {
  return std::max(heard_ns_, sent_.oldest_in_flight_ns());
}

/// When the last message that carries something wants to be followed, though nothing is to be sent: what follows it
/// sooner tells nothing of it. What follows may be lost with it, so others follow until its fate is known.
std::int64_t BulkLane::follow_ns() const {
  if (followers_ >= kMostFollowers || sent_.oldest_in_flight_ns() > carried_ns_) return kNever_ns;
  // The receipt will be judged by the round trip of then.
  const std::int64_t window_ns = std::max(sent_.reorder_window_ns(), pacer_.time_away_ns() / 8);
  return last_sent_ns_ + window_ns + window_ns / kFollowSpare;
}

std::size_t BulkLane::next(std::span<std::byte> to, std::int64_t now_ns) {
  if (to.size() < kMostMessageBytes) return 0;
  check_silence(now_ns);
  (void)inbox_.work();
  if (const auto receipt = receipts_.take_due(now_ns)) {
    ++counters_.receipts_sent;
    return write(*receipt, to.first(kSmallDatagram - kSealedBytes)).size();
  }
  if (const std::size_t bytes = next_statement(to.first(kSmallDatagram - kSealedBytes), now_ns)) {
    ++counters_.statements_sent;
    return bytes;
  }
  return next_numbered(to, now_ns);
}

std::size_t BulkLane::next_statement(std::span<std::byte> to, std::int64_t now_ns) {
  if (const auto answer = inbox_.take_answer()) return write(*answer, to).size();
  return outbox_.next_statement(to, pacer_.round_trip_ns(), now_ns).size();
}

BulkSource* BulkLane::most_urgent(std::int64_t now_ns) {
  BulkSource* best = nullptr;
  std::optional<std::uint8_t> least;
  for (BulkSource* source : sources_) {
    const auto urgency = source->urgency(now_ns);
    if (urgency && (!least || *urgency < *least)) best = source, least = urgency;
  }
  return best;
}

std::size_t BulkLane::next_numbered(std::span<std::byte> to, std::int64_t now_ns) {
  const std::size_t room = path_limit_.message_bytes();
  const bool probes = !has_probed_ && sent_.in_flight_bytes() > 0 && now_ns >= quiet_since_ns() + pacer_.probe_ns();
  const bool may_send = probes || pacer_.may_send(room + overhead_bytes_, sent_.in_flight_bytes(), now_ns);
  const bool follows = now_ns >= follow_ns() && !most_urgent(now_ns);
  if (!may_send && !follows) return 0;
  const auto body = to.first(room).subspan(BulkHead::kBytes);
  BulkSource::Item item;
  std::uint32_t source = kNoSource;
  const auto pad = [&](std::size_t size) {
    std::fill_n(to.begin() + BulkHead::kBytes, size, std::byte{0});
    item = {BulkType::kPadding, size, 0};
  };
  if (follows) {
    pad(kFollowerBytes);
  } else if (path_limit_.wants_probe(now_ns)) {
    path_limit_.on_probe(now_ns);
    pad(kLargeDatagram - kSealedBytes - BulkHead::kBytes);
  } else {
    BulkSource* from = most_urgent(now_ns);
    const auto made = from ? from->next(body, now_ns) : std::nullopt;
    if (!made) return 0;
    item = *made;
    source = static_cast<std::uint32_t>(std::find(sources_.begin(), sources_.end(), from) - sources_.begin());
  }
  const BulkHead head = sent_.next_head(item.type, pacer_.spacing(), now_ns);
  (void)write(head, to);
  const std::size_t bytes = BulkHead::kBytes + item.bytes;
  const std::size_t on_wire = bytes + overhead_bytes_;
  SentLog::Message message;
  message.sent_ns = now_ns;
  message.bytes = static_cast<std::uint32_t>(on_wire);
  message.tag = item.tag;
  message.source = source;
  message.full_flight_bytes = pacer_.full_flight(full_bytes(), sent_.in_flight_bytes() + on_wire);
  message.is_large = bytes + kSealedBytes > kSmallDatagram;
  message.follows = now_ns - last_sent_ns_ < kTogether_ns;
  if (sent_.in_flight_bytes() == 0) heard_ns_ = std::max(heard_ns_, now_ns);
  has_probed_ = has_probed_ || probes;
  if (source == kNoSource) {
    ++followers_;
  } else {
    followers_ = 0;
    carried_ns_ = now_ns;
  }
  sent_.add(head, message);
  last_sent_ns_ = now_ns;
  path_limit_.on_sent();
  if (!follows) pacer_.on_sent(on_wire, sent_.in_flight_bytes(), sent_.next_number(), now_ns);
  ++counters_.sent;
  counters_.sent_bytes += on_wire;
  return bytes;
}

std::int64_t BulkLane::next_time_ns(std::int64_t now_ns) {
  if (inbox_.has_answers() || inbox_.has_work()) return now_ns;
  std::int64_t at = std::min(receipts_.next_time_ns(), outbox_.next_statement_ns());
  if (sent_.in_flight_bytes() > 0) at = std::min(at, quiet_since_ns() + pacer_.timeout_ns());
  if (most_urgent(now_ns)) {
    if (!has_probed_ && sent_.in_flight_bytes() > 0) at = std::min(at, quiet_since_ns() + pacer_.probe_ns());
    at = std::min(at, pacer_.next_time_ns(full_bytes(), sent_.in_flight_bytes(), now_ns));
  } else {
    at = std::min(at, follow_ns());
    for (const BulkSource* source : sources_) at = std::min(at, source->next_time_ns(now_ns));
  }
  return std::max(at, now_ns);
}

}  // namespace farfeel::transport
