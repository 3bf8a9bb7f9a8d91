// Time-domain passivity of a two-port with delay: each end may give out only what the other end is known to have put
// in. Ryu, Artigas & Preusche, Mechatronics 20(7), 2010; the observer is Hannaford & Ryu's, IEEE T-RA 18(1), 2002.
//
// One scalar for all six degrees of freedom: P = f.v + tau.w. Counters are cumulative, so that a lost packet only
// under-credits. Known drawbacks: chatter of the dissipation, and drift where velocity is what is dissipated.
#pragma once

#include <algorithm>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::teleoperation {

/// One end. P is the power from this end into the line. Realtime-safe.
class PassivityEnd {
 public:
  /// The energy that this end has put in so far: send it along. Grows only.
  [[nodiscard]] double energy_in_J() const { return in_J_; }
  [[nodiscard]] double energy_out_J() const { return out_J_; }
  /// The newest counter of the other end; an older one changes nothing.
  void learn(double remote_in_J) { remote_in_J_ = std::max(remote_in_J_, remote_in_J); }

  /// An end that moves with V and is about to feel F (the line's force on it; P = -F.V): the force it may feel, with
  /// just the damping along V that keeps energy_out <= what the other end put in.
  [[nodiscard]] spatial::Vector6 damped_force(const spatial::Vector6& F, const spatial::Vector6& V,
                                              const spatial::Vector6& metric, double dt_s, double max_damping) {
    const double given_J = std::max(0.0, F.dot(V)) * dt_s;
    const double excess_J = out_J_ + given_J - remote_in_J_;
    const double speed_squared = V.cwiseProduct(metric).dot(V);
    spatial::Vector6 allowed = F;
    if (excess_J > 0 && speed_squared > 0)
      allowed -= std::min(max_damping, excess_J / (dt_s * speed_squared)) * metric.cwiseProduct(V);
    count(-allowed.dot(V) * dt_s);
    return allowed;
  }
  /// An end that feels the contact force F and is about to move with V (P = F.V, what pushes it feeds the
  /// line): the velocity it may move with.
  [[nodiscard]] spatial::Vector6 yielding_velocity(const spatial::Vector6& F, const spatial::Vector6& V, double dt_s) {
    const double given_J = std::max(0.0, -F.dot(V)) * dt_s;
    const double excess_J = out_J_ + given_J - remote_in_J_;
    spatial::Vector6 allowed = V;
    if (excess_J > 0 && F.squaredNorm() > 0) allowed += excess_J / (dt_s * F.squaredNorm()) * F;
    count(F.dot(allowed) * dt_s);
    return allowed;
  }

 private:
  void count(double into_line_J) {
    in_J_ += std::max(0.0, into_line_J);
    out_J_ += std::max(0.0, -into_line_J);
  }
  double in_J_ = 0, out_J_ = 0, remote_in_J_ = 0;
};

}  // namespace farfeel::teleoperation
