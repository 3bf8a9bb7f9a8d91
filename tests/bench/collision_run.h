// One benchmark scene under one motion: how long each library takes and how right it is.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/bench/benchmark_scenes.h"
#include "tests/bench/collision_peer.h"

namespace farfeel::bench {

struct Timing {
  double p50_us = 0, p95_us = 0, p99_us = 0, max_us = 0, pairs_mean = 0;
  std::vector<std::pair<double, double>> pairs_and_us;  ///< of each frame
};
struct Accuracy {
  std::size_t missed = 0, extra = 0, checked = 0;
  double max_error_rel = 0;  ///< of a signed distance, in sizes of the larger piece
};

/// One library with one scene open.
struct Entrant {
  std::string name;
  bool is_plain;  ///< overlap counts in every direction, as peers see it
  std::unique_ptr<CollisionPeer> peer;
};

/// For each entrant, frame by frame the least time of `replays` passes over the motion. The entrants take turns after
/// each pass, so that a busy machine is busy for all. is_cold: everything is forgotten before a frame.
[[nodiscard]] std::vector<Timing> timings(std::span<Entrant> entrants, double tolerance_m,
                                          const std::vector<spatial::Pose>& motion, int replays, bool is_cold);

/// Against the oracle on every `stride`-th frame, after all the frames before.
[[nodiscard]] std::vector<Accuracy> accuracies(const BenchmarkScene&, std::span<Entrant> entrants,
                                               const std::vector<spatial::Pose>& motion, std::size_t stride);

}  // namespace farfeel::bench
