// Whether a device's force drives the hand on and on: work that nobody put in.
//
// The wrench of a tick over the way of the handle in it is work on the hand. A touch that is passive gives back at most
// what the hand has put in since it began, and never more than a soft spring would hold at the force that there is:
//
//   E <- min(E - F.dx + (work of moving objects), |F|^2 / (2 K_soft) + (energy of the tool's motion))
//
// Where E falls below kAllowance_J while the force has been giving for kLong_s, forces and readings do not belong
// together: somewhere between them an axis or a sign is wrong.
#pragma once

#include "haptic_core/spatial/spatial.h"

namespace farfeel::devices {

/// Realtime-safe.
class WorkWatch {
 public:
  static constexpr double kLong_s = 0.05;
  /// Of a local model's updates (5 mJ), of readings that are late, and of couplings that are softer than K_soft.
  static constexpr double kAllowance_J = 0.1;

  /// The handle moved from one pose to another while F was on it, and moving objects did given_J on it in that time;
  /// the tool's motion holds moving_J. True: it gives too much.
  bool next(const spatial::Wrench& F, const spatial::Pose& from, const spatial::Pose& to, double given_J, double dt_s,
            double moving_J = 0) noexcept;
  /// From now on. A force that is there already may hold what it holds.
  void restart() noexcept {
    energy_J_ = giving_s_ = quiet_s_ = 0;
    is_anew_ = true;
  }
  [[nodiscard]] double least_J() const noexcept { return least_J_; }  ///< of E so far

 private:
  bool is_anew_ = true;
  double energy_J_ = 0, least_J_ = 0, giving_s_ = 0, quiet_s_ = 0;
};

}  // namespace farfeel::devices
