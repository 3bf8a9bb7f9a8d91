#include "transport/lane/sealed_lane.h"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <limits>

#include "transport/bytes/byte_cursor.h"

namespace farfeel::transport {
namespace {

std::atomic<std::uint64_t> forks{0};

/// How often this process is a child of another that used lanes: two processes must never count on with the same keys.
std::uint64_t forks_so_far() noexcept {
  static const int registered = pthread_atfork(nullptr, nullptr, [] { forks.fetch_add(1, std::memory_order_relaxed); });
  (void)registered;
  return forks.load(std::memory_order_relaxed);
}

}  // namespace

std::uint32_t receiver_index(std::span<const std::byte> datagram) noexcept {
  if (datagram.size() < kSealBytes || datagram.size() > kMaxDatagramBytes) return 0;
  ByteReader r(datagram);
  if (r.u8() != static_cast<std::uint8_t>(DatagramType::kData) || r.u8() != 0 || r.u16() != 0) return 0;
  return r.u32();
}

void SealedLane::retire(Place place) noexcept {
  if (keys_[place]) retired_ = retired_ + keys_[place]->window.counters();
  keys_[place].reset();
}

void SealedLane::become_current(Place place) noexcept {
  retire(kPrevious);
  keys_[kPrevious] = std::move(keys_[kCurrent]);
  keys_[kCurrent] = std::move(keys_[place]);
  keys_[place].reset();
}

void SealedLane::adopt(const LaneKeys& keys) noexcept {
  if (keys.generation <= newest_adopted_) return;
  if (const std::uint64_t now_forks = forks_so_far(); now_forks != forks_) {
    forget();
    forks_ = now_forks;
  }
  newest_adopted_ = keys.generation;
  retire(kNext);
  keys_[kNext].emplace(keys);
  if (role_ == Role::kInitiator) become_current(kNext);
}

void SealedLane::forget() noexcept {
  for (const Place place : {kCurrent, kPrevious, kNext}) retire(place);
}

bool SealedLane::can_send(std::int64_t now_ns) const noexcept {
  return keys_[kCurrent] && now_ns - keys_[kCurrent]->keys.made_ns < kKeyLife_ns &&
         keys_[kCurrent]->next_counter != std::numeric_limits<std::uint64_t>::max() && forks_so_far() == forks_;
}

void SealedLane::skip_to(std::uint64_t counter) noexcept {
  if (keys_[kCurrent]) keys_[kCurrent]->next_counter = std::max(keys_[kCurrent]->next_counter, counter);
}

std::uint64_t SealedLane::sending_generation() const noexcept {
  return keys_[kCurrent] ? keys_[kCurrent]->keys.generation : 0;
}

std::size_t SealedLane::seal(std::uint8_t type, std::span<const std::byte> message, std::span<std::byte> to,
                             std::int64_t now_ns) noexcept {
  const std::size_t size = message.size() + kSealBytes;
  if (!can_send(now_ns) || size > to.size() || size > kMaxDatagramBytes) return 0;
  Keys& keys = *keys_[kCurrent];
  const std::uint64_t counter = keys.next_counter++;
  ByteWriter w(to);
  w.u8(static_cast<std::uint8_t>(DatagramType::kData));
  w.u8(0);
  w.u16(0);
  w.u32(keys.keys.remote_index);
  w.u64(counter);
  w.u8(type);
  if (message.data() != to.data() + kDataHeaderBytes + 1) w.bytes(message);
  const auto plain = to.subspan(kDataHeaderBytes, message.size() + 1);
  keys.send.seal(counter, to.first(kDataHeaderBytes), plain, to.subspan(kDataHeaderBytes, plain.size() + kTagBytes));
  ++sealed_;
  return size;
}

std::optional<SealedLane::Opened> SealedLane::open(std::span<std::byte> datagram, std::int64_t now_ns) noexcept {
  const std::uint32_t index = receiver_index(datagram);
  if (index == 0) {
    ++rejects_.malformed;
    return std::nullopt;
  }
  for (const Place place : {kCurrent, kNext, kPrevious}) {
    if (!keys_[place] || keys_[place]->keys.local_index != index) continue;
    Keys& keys = *keys_[place];
    if (now_ns - keys.keys.made_ns >= kKeyLife_ns) break;
    ByteReader r(datagram.subspan(8));
    const std::uint64_t counter = r.u64();
    const auto sealed = datagram.subspan(kDataHeaderBytes);
    const auto plain = sealed.first(sealed.size() - kTagBytes);
    if (!keys.receive.open(counter, datagram.first(kDataHeaderBytes), sealed, plain)) {
      ++rejects_.forged;
      return std::nullopt;
    }
    const auto verdict = keys.window.accept(counter);
    if (verdict == ReplayWindow::Verdict::kDuplicate) return std::nullopt;
    const std::uint64_t generation = keys.keys.generation;
    Opened opened{static_cast<std::uint8_t>(plain[0]), plain.subspan(1),
                  verdict == ReplayWindow::Verdict::kNewest && generation >= newest_heard_, generation,
                  keys.keys.session};
    newest_heard_ = std::max(newest_heard_, generation);
    if (place == kNext) become_current(kNext);
    return opened;
  }
  ++rejects_.unknown_index;
  return std::nullopt;
}

bool SealedLane::knows(std::span<const std::byte> datagram) const noexcept {
  const std::uint32_t index = receiver_index(datagram);
  if (index == 0) return false;
  for (const auto& keys : keys_) {
    if (keys && keys->keys.local_index == index) return true;
  }
  return false;
}

LaneCounters SealedLane::counters() const noexcept {
  LaneCounters sum = retired_;
  for (const auto& keys : keys_) {
    if (keys) sum = sum + keys->window.counters();
  }
  sum.sent = sealed_;
  return sum;
}

}  // namespace farfeel::transport
