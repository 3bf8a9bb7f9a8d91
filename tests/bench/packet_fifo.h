// One direction of a bottleneck: packets go in when they come, and out when their impairment says so, in order. Time is
// an argument.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "transport/link/impairment.h"

namespace farfeel::bench {

/// For links that keep order and duplicate nothing. Allocates when it is made and never again.
class PacketFifo {
 public:
  static constexpr std::size_t kMostBytes = 1'500;

  PacketFifo(const transport::LinkSpec& spec, std::uint64_t seed, std::size_t most_packets)
      : impairment_(spec, seed), packets_(most_packets) {}

  /// Where a packet that comes may be written, before push(). Nothing else may be called between.
  [[nodiscard]] std::span<std::byte> room() { return packets_[last_ % packets_.size()].bytes; }
  /// The packet of that size in room() came at now_ns, which never goes back. Without room for one more it is dropped.
  void push(std::size_t size, std::int64_t now_ns) {
    const auto releases = impairment_.releases(now_ns, size);
    if (releases.empty()) return;
    if (last_ + 1 - first_ >= packets_.size()) {  // room() stays free
      ++overflow_;
      return;
    }
    Packet& packet = packets_[last_++ % packets_.size()];
    packet.size = size;
    packet.due_ns = releases.front();
  }

  /// When the next one leaves; the end of time if there is none.
  [[nodiscard]] std::int64_t next_ns() const {
    return first_ == last_ ? std::numeric_limits<std::int64_t>::max() : packets_[first_ % packets_.size()].due_ns;
  }
  /// The one that leaves next, which there must be. Valid until the next push().
  [[nodiscard]] std::span<const std::byte> pop() {
    const Packet& packet = packets_[first_++ % packets_.size()];
    return std::span(packet.bytes).first(packet.size);
  }

  [[nodiscard]] const transport::Impairment::Counters& counters() const { return impairment_.counters(); }
  [[nodiscard]] std::uint64_t overflow() const { return overflow_; }

 private:
  struct Packet {
    std::int64_t due_ns = 0;
    std::size_t size = 0;
    std::array<std::byte, kMostBytes> bytes;
  };
  transport::Impairment impairment_;
  std::vector<Packet> packets_;
  std::size_t first_ = 0, last_ = 0;  // last_: the one after the last
  std::uint64_t overflow_ = 0;
};

}  // namespace farfeel::bench
