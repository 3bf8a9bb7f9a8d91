// One benchmark scene under one motion: how long each library takes and how right it is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"
#include "tests/bench/collision_peer.h"
#include "tests/bench/recorded_motion.h"

namespace farfeel::bench {

struct BenchScene {
  std::string name;
  geometry::HapticSurface S, T;
  double tolerance_m;
  MotionPlan plan;
  std::optional<double> pairs;  ///< that the motion is to keep near, on average
};

struct Timing {
  double p50_us = 0, p95_us = 0, p99_us = 0, max_us = 0, pairs_mean = 0;
};
struct Accuracy {
  std::size_t missed = 0, extra = 0, checked = 0;
  double max_error_rel = 0;  ///< of a signed distance, in sizes of the larger piece
};

/// Each frame's time is the least of `replays` passes over the motion. is_cold: everything is forgotten before a frame.
[[nodiscard]] Timing timing(CollisionPeer&, double tolerance_m, const std::vector<spatial::Pose>& motion, int replays,
                            bool is_cold, std::vector<std::pair<double, double>>* pairs_and_us = nullptr);

/// Against the oracle on every `stride`-th frame. is_plain: overlap counts in every direction, as peers see it.
[[nodiscard]] Accuracy accuracy(const BenchScene&, CollisionPeer&, const std::vector<spatial::Pose>& motion,
                                std::size_t stride, bool is_plain);

}  // namespace farfeel::bench
