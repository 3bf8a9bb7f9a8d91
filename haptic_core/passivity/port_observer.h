// How much energy has gone through a port, and how far below zero it ever was.
#pragma once

#include <algorithm>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::passivity {

/// Counts energy that flows *into* a subsystem. A passive one never gives back more: least_J() stays at or above zero.
/// Hannaford & Ryu, IEEE T-RA 18(1), 2002, with one scalar for all six degrees of freedom: f.v + tau.w.
class PortObserver {
 public:
  /// F acts on the subsystem and V is its velocity, about the same point in the same frame, during dt_s.
  void observe(const spatial::Wrench& F, const spatial::Twist& V, double dt_s) noexcept {
    add(spatial::power_W(F, V) * dt_s);
  }
  void add(double energy_J) noexcept {
    energy_J_ += energy_J;
    least_J_ = std::min(least_J_, energy_J_);
  }
  [[nodiscard]] double energy_J() const noexcept { return energy_J_; }
  [[nodiscard]] double least_J() const noexcept { return least_J_; }  ///< <= 0

 private:
  double energy_J_ = 0;
  double least_J_ = 0;
};

}  // namespace farfeel::passivity
