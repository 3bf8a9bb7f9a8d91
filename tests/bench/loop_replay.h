// Open loop: every rung of the local model along one path of the hand, against the force at the same pose without
// delay.
#pragma once

#include "haptic_core/local_model/local_model.h"
#include "tests/bench/remote_across_link.h"
#include "tests/bench/stroked_scenes.h"
#include "tests/bench/strokes.h"
#include "transport/link/link_spec.h"

namespace farfeel::bench {

/// The surface's own force along the path at kTruth_hz: no link, no local model.
class ReplayTruth {
 public:
  static constexpr double kTruth_hz = 5000;

  /// Precomputed for the judged part of the path. The scene must outlive it.
  ReplayTruth(const StrokedScene& scene, std::vector<Stroke> strokes, double start_m);

  [[nodiscard]] const StrokedScene& scene() const { return scene_; }
  [[nodiscard]] double length_s() const { return path_.length_s(); }
  /// The hand, t_s after the strokes began; before, it rests where they start.
  [[nodiscard]] contact_service::ToolPose hand(double t_s, std::uint32_t sequence) const;
  [[nodiscard]] const std::vector<spatial::Vector6>& wrenches() const { return wrenches_; }
  /// Mean square about the mean, of torque [N^2 m^2] and force [N^2].
  [[nodiscard]] double torque_variance() const { return torque_variance_; }
  [[nodiscard]] double force_variance() const { return force_variance_; }

 private:
  [[nodiscard]] spatial::Pose X_WT(double t_s) const;

  const StrokedScene& scene_;
  StrokePath path_;
  std::vector<spatial::Vector6> wrenches_;
  double torque_variance_ = 0, force_variance_ = 0;
};

struct Replayed {
  double force_share = 0, torque_share = 0;  ///< rms error over the truth's own rms variation
  double contact_kB_s = 0, tile_kB_s = 0;    ///< received during the strokes, payloads
  double outline_kB = 0;                     ///< received before
  double all_tile_kB = 0;                    ///< received from the start
  double late_share = 0;                     ///< of the ticks: heights of some contact were missing
};
[[nodiscard]] Replayed replay(const ReplayTruth& truth, local_model::Rung rung, double tick_hz,
                              const transport::LinkSpec& link, const RemoteAcrossLink::Options&);
[[nodiscard]] inline Replayed replay(const ReplayTruth& truth, local_model::Rung rung, double tick_hz,
                                     const transport::LinkSpec& link) {
  return replay(truth, rung, tick_hz, link, RemoteAcrossLink::options_of(rung));
}

}  // namespace farfeel::bench
