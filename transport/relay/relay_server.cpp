#include "transport/relay/relay_server.h"

#include <algorithm>
#include <cassert>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

constexpr double kBytesPerKbit_s = 125;
constexpr double kBurst_s = 0.1;             // of a token's rate may come at once
constexpr double kLeastBurst_bytes = 65536;  // so that a low rate still takes a burst of 50 datagrams
constexpr double kHeaderBytes = 48;          // IPv6 and UDP, counted with each datagram

}  // namespace

std::span<const RelayServer::Outgoing> RelayServer::receive(const Received& received, std::int64_t now_ns,
                                                            std::uint64_t wall_s) {
  out_size_ = 0;
  const auto type = relay_type(received.bytes);
  if (!type) {
    forward(received, now_ns);
  } else if (*type == static_cast<std::uint8_t>(RelayType::kRegister)) {
    take_registration(received, now_ns, wall_s);
  } else {
    ++counters_.strangers;
  }
  return std::span(out_).first(out_size_);
}

void RelayServer::forward(const Received& received, std::int64_t now_ns) {
  const auto from = by_address_.find(to_bytes(received.from));
  if (from == by_address_.end() || received.bytes.empty()) {
    ++counters_.strangers;
    return;
  }
  const auto peer = opposite(from->second);
  if (peer == ends_.end()) {
    ++counters_.unpaired;
    return;
  }
  Use& use = uses_.at(std::get<0>(from->second));
  const double rate = use.grant.rate_kbit * kBytesPerKbit_s;
  use.room_bytes += static_cast<double>(now_ns - use.filled_ns) * 1e-9 * rate;
  use.room_bytes = std::min(use.room_bytes, std::max(kLeastBurst_bytes, rate * kBurst_s));
  use.filled_ns = now_ns;
  const double cost = static_cast<double>(received.bytes.size()) + kHeaderBytes;
  if (use.room_bytes < cost) {
    ++counters_.over_rate;
    return;
  }
  use.room_bytes -= cost;
  ++counters_.forwarded;
  counters_.forwarded_bytes += received.bytes.size();
  Outgoing& out = out_[out_size_++];
  out = {peer->second.local, peer->second.address, received.bytes, std::nullopt};
  if (received.has_marking) out.marking = UdpSocket::Marking{received.dscp, received.ecn};
}

void RelayServer::take_registration(const Received& received, std::int64_t now_ns, std::uint64_t wall_s) {
  const auto message = read_register(received.bytes);
  if (!message) {
    ByteReader reader(received.bytes);
    (void)reader.u8();
    const bool is_other_version = reader.u8() != kRelayVersion;
    (void)reader.u16();
    const std::uint64_t nonce = reader.u64();
    // As long as what is asked for now, so that the answer is the shorter one.
    if (is_other_version && received.bytes.size() >= RegisterMessage::kBytes)
      return refuse(received, RelayRefusal::kOtherVersion, nonce, wall_s);
    ++counters_.strangers;
    return;
  }
  const std::int64_t period = now_ns / kCookiePeriod_ns;
  if (!is_same_secret(message->cookie, cookie(received.from, period)) &&
      !is_same_secret(message->cookie, cookie(received.from, period - 1))) {
    ++counters_.challenged;
    write(ChallengeMessage{message->nonce, cookie(received.from, period)},
          put(received.to, received.from, ChallengeMessage::kBytes));
    return;
  }
  const RelayToken token = make_token(key_, message->grant);
  if (!is_signed(received.bytes, token.key))
    return refuse(received, RelayRefusal::kUnknownToken, message->nonce, wall_s);
  if (wall_s >= message->grant.expiry_s) return refuse(received, RelayRefusal::kExpired, message->nonce, wall_s);

  const Key key{message->grant.id, message->room, message->slot, message->role};
  auto end = ends_.find(key);
  const bool is_new = end == ends_.end();
  if (!is_new && message->instance < end->second.instance && now_ns - end->second.heard_ns < kSlotLife_ns)
    return refuse(received, RelayRefusal::kSlotTaken, message->nonce, wall_s);
  const auto used_by = by_address_.find(to_bytes(received.from));
  const bool has_other_place = used_by != by_address_.end() && used_by->second != key;
  if (has_other_place) erase(ends_.find(used_by->second));  // a socket is one end
  if (is_new) {
    const auto use = uses_.find(message->grant.id);
    const std::size_t token_ends = use == uses_.end() ? 0 : use->second.ends;
    if (ends_.size() >= kMostEnds || token_ends >= message->grant.most_ends)
      return refuse(received, RelayRefusal::kFull, message->nonce, wall_s);
    end = ends_.emplace(key, End{}).first;
    auto& taken = uses_.try_emplace(message->grant.id, Use{message->grant, token.key, 0, 0, now_ns}).first->second;
    ++taken.ends;
  }
  const bool has_changed = is_new || end->second.address != received.from || end->second.instance != message->instance;
  if (!is_new) by_address_.erase(to_bytes(end->second.address));
  by_address_[to_bytes(received.from)] = key;
  end->second = {received.from, received.to, message->instance, message->nonce, now_ns};
  ++counters_.registered;

  const Use& use = uses_.at(message->grant.id);
  tell(key, end->second, use, now_ns);
  if (const auto peer = opposite(key); has_changed && peer != ends_.end()) tell(peer->first, peer->second, use, now_ns);
}

void RelayServer::tell(const Key& key, const End& end, const Use& use, std::int64_t now_ns) {
  RegisteredMessage message;
  message.slot = std::get<2>(key);
  message.nonce = end.nonce;
  message.cookie = cookie(end.address, now_ns / kCookiePeriod_ns);
  message.own = end.address;
  if (const auto peer = opposite(key); peer != ends_.end()) {
    message.peer = peer->second.address;
    // Both ends get the same, whichever asks; it changes when either starts anew.
    const bool is_master = std::get<3>(key) == RelayRole::kMaster;
    std::array<std::byte, 41> pair{};
    ByteWriter writer(pair);
    writer.u64(std::get<0>(key));
    writer.bytes(std::get<1>(key));
    writer.u8(std::get<2>(key));
    writer.u64(is_master ? end.instance : peer->second.instance);
    writer.u64(is_master ? peer->second.instance : end.instance);
    message.probe_secret = keyed_mac(secret_, pair);
  }
  write(message, use.key, put(end.local, end.address, RegisteredMessage::kBytes));
}

void RelayServer::refuse(const Received& received, RelayRefusal reason, std::uint64_t nonce, std::uint64_t wall_s) {
  ++counters_.refused;
  write(RefusedMessage{reason, nonce, static_cast<std::int64_t>(wall_s)},
        put(received.to, received.from, RefusedMessage::kBytes));
}

std::span<std::byte> RelayServer::put(const Address& local, const Address& to, std::size_t size) {
  assert(out_size_ < out_.size());
  const std::span<std::byte> bytes = std::span(buffers_[out_size_]).first(size);
  out_[out_size_++] = {local, to, bytes, std::nullopt};
  return bytes;
}

// Under a key of its own for each period, made from the secret: nothing to keep, nothing to renew.
Mac16 RelayServer::cookie(const Address& address, std::int64_t period) const noexcept {
  std::array<std::byte, 8> bytes{};
  ByteWriter writer(bytes);
  writer.i64(period);
  return keyed_mac(derived_key(secret_, bytes), to_bytes(address));
}

RelayServer::Ends::iterator RelayServer::opposite(const Key& key) {
  const auto& [token, room, slot, role] = key;
  return ends_.find({token, room, slot, role == RelayRole::kMaster ? RelayRole::kSlave : RelayRole::kMaster});
}

RelayServer::Ends::iterator RelayServer::erase(Ends::iterator end) {
  by_address_.erase(to_bytes(end->second.address));
  const auto use = uses_.find(std::get<0>(end->first));
  if (--use->second.ends == 0) uses_.erase(use);
  return ends_.erase(end);
}

void RelayServer::forget(std::int64_t now_ns, std::uint64_t wall_s) {
  for (auto end = ends_.begin(); end != ends_.end();) {
    const bool is_over =
        now_ns - end->second.heard_ns > kEndLife_ns || wall_s >= uses_.at(std::get<0>(end->first)).grant.expiry_s;
    end = is_over ? erase(end) : std::next(end);
  }
}

}  // namespace farfeel::transport
