// A network in simulated time: datagrams handed to it come out when their impairment says, and nobody sleeps.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "transport/link/impairment.h"

namespace farfeel::transport {

/// Both directions between one master and one slave.
class SimulatedNetwork {
 public:
  using Deliver = std::function<void(std::span<const std::byte>)>;

  SimulatedNetwork(const LinkSpec& spec, std::uint64_t seed)
      : ways_{Way{{spec, seed}, {}}, Way{{spec, seed + 1}, {}}} {}

  enum Direction : std::size_t { kUp, kDown };
  void send(Direction direction, std::span<const std::byte> datagram) {
    if (is_cut) return;
    for (const std::int64_t release_ns : ways_[direction].impairment.releases(now_ns, datagram.size()))
      ways_[direction].waiting.emplace(release_ns, std::vector(datagram.begin(), datagram.end()));
  }
  /// Delivers what is due by now.
  void deliver(Direction direction, const Deliver& to) {
    auto& waiting = ways_[direction].waiting;
    while (!waiting.empty() && waiting.begin()->first <= now_ns) {
      const auto datagram = std::move(waiting.begin()->second);
      waiting.erase(waiting.begin());
      if (!is_cut) to(datagram);
    }
  }
  void forget_all() {
    for (Way& way : ways_) way.waiting.clear();
  }

  std::int64_t now_ns = 1;
  bool is_cut = false;  ///< nothing gets through, either way

 private:
  struct Way {
    Impairment impairment;
    std::multimap<std::int64_t, std::vector<std::byte>> waiting;
  };
  std::array<Way, 2> ways_;
};

}  // namespace farfeel::transport
