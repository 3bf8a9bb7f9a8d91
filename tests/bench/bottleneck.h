// A link of our own between two network namespaces, for whole IP packets: whatever the kernel sends, TCP included, goes
// through one bottleneck each way.
//
//   master's namespace: tun 10.8.0.1  ══ [FIFO, rate] ─ delay, loss ══  tun 10.8.0.2 :slave's namespace
//
// It is a program like others, so it notes how late it was: where that is much, a run says nothing of the link.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <tl/expected.hpp>

#include "tests/bench/packet_fifo.h"
#include "tests/bench/two_ends.h"
#include "transport/link/relay.h"

namespace farfeel::bench {

class Bottleneck {
 public:
  struct Direction {
    transport::Impairment::Counters counters;
    std::uint64_t overflow = 0;  ///< packets beyond the room that the link has for them
  };
  struct Summary {
    Direction up, down;                       ///< up: from the master
    transport::Relay::ReleaseError lateness;  ///< of packets that left, and of its own wake-ups
  };

  /// Fails where there is no cable, or no TUN device may be made. The ends' addresses are the devices' from then on.
  [[nodiscard]] static tl::expected<std::unique_ptr<Bottleneck>, std::string> open(TwoEnds&);
  Bottleneck(const Bottleneck&) = delete;
  Bottleneck& operator=(const Bottleneck&) = delete;
  ~Bottleneck();

  /// From now on packets pass, until end(). What is under way then is lost.
  void begin(const transport::LinkSpec&, std::uint64_t seed);
  [[nodiscard]] Summary end();

  static constexpr int kFifoPriority = 60;  ///< above the threads that are measured

 private:
  Bottleneck() = default;
  void run(const transport::LinkSpec&, std::uint64_t seed);

  int master_ = -1, slave_ = -1;  // devices
  std::thread thread_;
  std::atomic<bool> is_over_{false};
  Summary summary_;
};

}  // namespace farfeel::bench
