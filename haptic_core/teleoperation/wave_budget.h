// What keeps waves passive where messages are lost, late, or felt for longer than they were made for: an end uses no
// more wave energy than the other one has sent.
#pragma once

#include <algorithm>
#include <cmath>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::teleoperation {

/// One end's. Realtime-safe.
class WaveBudget {
 public:
  /// The newest counter of the other end; an older one changes nothing.
  void learn(double sent_J) noexcept { learnt_J_ = std::max(learnt_J_, sent_J); }
  /// The part of an arrived wave that may be used for dt_s.
  [[nodiscard]] spatial::Vector6 afforded(const spatial::Vector6& wave, double dt_s) noexcept {
    const double wanted_J = 0.5 * wave.squaredNorm() * dt_s;
    const double left_J = std::max(0.0, learnt_J_ - used_J_);
    const double share = wanted_J <= left_J * (1 + 1e-9) ? 1 : std::sqrt(left_J / wanted_J);
    used_J_ += share * share * wanted_J;
    return share * wave;
  }
  void send(const spatial::Vector6& wave, double dt_s) noexcept { sent_J_ += 0.5 * wave.squaredNorm() * dt_s; }
  [[nodiscard]] double sent_J() const noexcept { return sent_J_; }

 private:
  double sent_J_ = 0, used_J_ = 0, learnt_J_ = 0;
};

}  // namespace farfeel::teleoperation
