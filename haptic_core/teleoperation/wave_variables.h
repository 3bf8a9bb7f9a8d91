// Wave variables: a line that stays passive whatever its delay. Niemeyer & Slotine, IEEE J. Oceanic Eng. 16(1), 1991.
//
// Each end has a power P = F.V into the line. With b the wave impedance,
//   u = (b V + F) / sqrt(2 b)   goes out,   w = (b V - F) / sqrt(2 b)   comes in,   P = (u^2 - w^2) / 2,
// so what is delayed is energy, never more than was sent. An end that knows its V answers with F, and the other way
// round. Known drawbacks: reflections where the impedance does not match, and drift of position.
#pragma once

#include <cmath>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::teleoperation {

/// One end of the line, in six degrees of freedom. Realtime-safe.
class WaveTerminal {
 public:
  /// Impedances > 0, of rotation [Nms/rad] and translation [Ns/m].
  WaveTerminal(double rotational_Nms_per_rad, double translational_Ns_per_m) {
    b_ << Eigen::Vector3d::Constant(rotational_Nms_per_rad), Eigen::Vector3d::Constant(translational_Ns_per_m);
  }

  /// The force that this end exerts on the line when it moves with V and `in` arrives.
  [[nodiscard]] spatial::Vector6 force(const spatial::Vector6& V, const spatial::Vector6& in) const {
    return b_.cwiseProduct(V) - root().cwiseProduct(in);
  }
  /// What it sends meanwhile.
  [[nodiscard]] spatial::Vector6 out(const spatial::Vector6& V, const spatial::Vector6& in) const {
    return root().cwiseProduct(V) - in;
  }
  [[nodiscard]] const spatial::Vector6& impedance() const { return b_; }

 private:
  [[nodiscard]] spatial::Vector6 root() const { return (2 * b_).cwiseSqrt(); }
  spatial::Vector6 b_;
};

}  // namespace farfeel::teleoperation
