// The haptic lane beside a bulk transfer: poses up at 1 kHz, each answered at once, both sealed, through real sockets.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <tl/expected.hpp>
#include <vector>

#include "tests/bench/link_method.h"

namespace farfeel::bench {

class HapticStream {
 public:
  [[nodiscard]] static tl::expected<std::unique_ptr<HapticStream>, std::string> begin(const TwoEnds&);
  ~HapticStream();

  /// Round trips are noted from now on.
  void note_from_now() { notes_ = true; }
  struct Summary {
    std::vector<double> rtt_ms;
    std::uint64_t sent = 0;
  };
  [[nodiscard]] Summary end();
  /// What the slave has sent on this lane so far, all headers counted.
  [[nodiscard]] const std::atomic<std::uint64_t>& answer_bytes() const { return answer_bytes_; }

  /// On the wire: IPv4, UDP, sealing and a message of today's, an answer with seven contacts.
  [[nodiscard]] static std::size_t answer_wire_bytes();
  static constexpr double kRate_Hz = 1000;
  static constexpr int kFifoPriority = 50;

 private:
  explicit HapticStream(std::unique_ptr<LinkMethod> lane);
  void ask();
  void answer();

  std::unique_ptr<LinkMethod> lane_;
  std::atomic<bool> is_over_{false}, notes_{false};
  std::atomic<std::uint64_t> answer_bytes_{0};
  Summary summary_;
  std::thread master_, slave_;
};

}  // namespace farfeel::bench
