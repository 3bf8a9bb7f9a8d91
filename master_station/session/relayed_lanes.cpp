#include "master_station/session/relayed_lanes.h"

#include <algorithm>
#include <limits>

namespace farfeel::master_station {
namespace {

using transport::LaneKind;

/// A slave's lane sends at least each 20 ms while it lives.
constexpr std::int64_t kSilence_ns = 250'000'000;
/// One that was never heard is still being greeted, which takes a long way's round trip or two.
constexpr std::int64_t kFirstWord_ns = 1'000'000'000;

constexpr std::size_t at(LaneKind lane) {
  return static_cast<std::size_t>(lane);
}

}  // namespace

RelayedLanes::RelayedLanes(const transport::RelayAccess& access, std::int64_t now_ns) : access_(access) {
  start(LaneKind::kBulk, now_ns);
}

void RelayedLanes::start(LaneKind lane, std::int64_t now_ns) {
  lanes_[at(lane)].emplace(Lane{
      transport::RelayClient(access_.options(transport::RelayRole::kMaster, static_cast<std::uint8_t>(lane)), now_ns),
      now_ns});
}

void RelayedLanes::use_haptic(bool is_used, std::int64_t now_ns) {
  auto& haptic = lanes_[at(LaneKind::kHaptic)];
  if (is_used && !haptic) start(LaneKind::kHaptic, now_ns);
  if (!is_used) haptic.reset();
}

bool RelayedLanes::take(LaneKind lane, const transport::Address& from, std::span<const std::byte> datagram,
                        std::int64_t now_ns) {
  auto& kept = lanes_[at(lane)];
  if (!kept) return transport::relay_type(datagram).has_value();
  const transport::Address before = kept->client.path();
  const bool was_taken = kept->client.receive(from, datagram, now_ns);
  if (kept->client.path() != before) kept->since_ns = now_ns;
  return was_taken;
}

void RelayedLanes::heard_at(LaneKind lane, std::int64_t heard_ns, std::int64_t now_ns) {
  auto& kept = lanes_[at(lane)];
  if (!kept) return;
  kept->since_ns = std::max(kept->since_ns, heard_ns);
  if (now_ns - kept->since_ns <= (heard_ns > 0 ? kSilence_ns : kFirstWord_ns)) return;
  kept->since_ns = now_ns;  // the next way has as long
  kept->client.note_silence(now_ns);
}

void RelayedLanes::on_time(std::int64_t now_ns, const SendTo& send_to) {
  for (const LaneKind lane : {LaneKind::kHaptic, LaneKind::kBulk}) {
    auto& kept = lanes_[at(lane)];
    while (kept) {
      const auto out = kept->client.next(now_ns);
      if (!out) break;
      send_to(lane, out->to, out->bytes);
    }
  }
}

std::int64_t RelayedLanes::next_time_ns() const noexcept {
  std::int64_t next_ns = std::numeric_limits<std::int64_t>::max();
  for (const auto& lane : lanes_)
    if (lane) next_ns = std::min(next_ns, lane->client.due_ns());
  return next_ns;
}

bool RelayedLanes::is_open(LaneKind lane, std::int64_t now_ns) {
  auto& kept = lanes_[at(lane)];
  if (!kept) return false;
  const auto state = kept->client.state(now_ns);
  kept->was_open = kept->was_open || state == transport::RelayClient::State::kRelayed ||
                   state == transport::RelayClient::State::kDirect;
  return kept->was_open;
}

transport::Address RelayedLanes::path(LaneKind lane) const noexcept {
  const auto& kept = lanes_[at(lane)];
  return kept ? kept->client.path() : access_.relay;
}

bool RelayedLanes::is_direct(LaneKind lane) const noexcept {
  return path(lane) != access_.relay;
}

std::string RelayedLanes::trouble(std::int64_t now_ns) const {
  const transport::RelayClient& client = lanes_[at(LaneKind::kBulk)]->client;
  if (const auto trouble = client.trouble(now_ns)) return trouble->message;
  switch (client.state(now_ns)) {
    case transport::RelayClient::State::kAsking:
      return "asking the relay at " + transport::to_string(access_.relay);
    case transport::RelayClient::State::kAlone:
      return "the slave is not at the relay at " + transport::to_string(access_.relay) +
             ": see that it runs, with the same --relay and token, and with the key that is trusted here";
    default:
      return {};
  }
}

}  // namespace farfeel::master_station
