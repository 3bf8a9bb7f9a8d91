// Open loop: every rung of the local model along one path of the hand, against the force at the same pose without
// delay.
//
// What is compared is what reaches the tool in the real loop: the wrench that a tick's step applies, with the step's
// own linearisation along the way that the hand made in it (tool::applied_wrench), held for all of the tick. The truth
// is the surface's wrench, summed in finer steps than the loop's, at the middles of intervals ten a millisecond, each
// against the tick that it falls into: finer than any tick, so that what holding costs is seen at every rate.
#pragma once

#include <cmath>

#include "haptic_core/local_model/local_model.h"
#include "tests/bench/remote_across_link.h"
#include "tests/bench/stroked_scenes.h"
#include "tests/bench/strokes.h"
#include "transport/link/link_spec.h"

namespace farfeel::bench {

/// The surface's own force along the path at kTruth_hz: no link, no local model.
class ReplayTruth {
 public:
  static constexpr double kTruth_hz = 10'000;

  /// Precomputed for the judged part of the path. The scene must outlive it.
  ReplayTruth(const StrokedScene& scene, std::vector<Stroke> strokes, double start_m);

  [[nodiscard]] const StrokedScene& scene() const { return scene_; }
  [[nodiscard]] double length_s() const { return path_.length_s(); }
  /// The hand, t_s after the strokes began; before, it rests where they start.
  [[nodiscard]] contact_service::ToolPose hand(double t_s, std::uint32_t sequence) const;
  /// Of the middle of each interval.
  [[nodiscard]] const std::vector<spatial::Vector6>& wrenches() const { return wrenches_; }
  /// Middle of an interval, from when the strokes began.
  [[nodiscard]] static double middle_s(std::size_t interval) {
    return (static_cast<double>(interval) + 0.5) / kTruth_hz;
  }
  /// Mean square about the mean, of torque [N^2 m^2] and force [N^2].
  [[nodiscard]] double torque_variance() const { return torque_variance_; }
  [[nodiscard]] double force_variance() const { return force_variance_; }
  /// How far from To the force's line passes: torque's rms variation over the mean force. A few micrometres where the
  /// tool is a ball about To, and then a share of the torque's variation compares nothing with nothing.
  [[nodiscard]] double arm_m() const { return std::sqrt(torque_variance_) / mean_force_N_; }
  [[nodiscard]] double mean_force_N() const { return mean_force_N_; }

 private:
  [[nodiscard]] spatial::Pose X_WT(double t_s) const;

  const StrokedScene& scene_;
  StrokePath path_;
  std::vector<spatial::Vector6> wrenches_;
  double torque_variance_ = 0, force_variance_ = 0, mean_force_N_ = 0;
};

struct Replayed {
  double force_share = 0, torque_share = 0;  ///< rms error over the truth's own rms variation
  double arm_off_m = 0, truth_arm_m = 0;     ///< the torque's rms error over the truth's mean force; ReplayTruth::arm_m
  double contact_kB_s = 0, tile_kB_s = 0;    ///< received during the strokes, payloads
  double outline_kB = 0;                     ///< received before
  double all_tile_kB = 0;                    ///< received from the start
  double late_share = 0;                     ///< of the ticks: heights of some contact were missing
  long late_ticks = 0;                       ///< those ticks
};
/// What a feed that knew the path would send: each tile that a tick of 1 ms on it needs, once, coded as the feed codes
/// a tile under a hand that moves; payloads.
[[nodiscard]] std::uint64_t oracle_tile_bytes(const ReplayTruth& truth);
[[nodiscard]] Replayed replay(const ReplayTruth& truth, local_model::Rung rung, double tick_hz,
                              const transport::LinkSpec& link, const RemoteAcrossLink::Options&);
[[nodiscard]] inline Replayed replay(const ReplayTruth& truth, local_model::Rung rung, double tick_hz,
                                     const transport::LinkSpec& link) {
  return replay(truth, rung, tick_hz, link, RemoteAcrossLink::options_of(rung));
}

}  // namespace farfeel::bench
