// How a change is let in: all lags and shares between a contact as it was received and as it is felt.
//
// Every change starts with the force before it, and the rest is let in or let go over some 20 ms:
//   direction, slope, point   turn and move towards those received, at constant stored energy (follow)
//   depth                     felt = depth - recess; the recess goes to its goal as far as a tank pays (to_let_in)
//   stiffness                 k = share k_received; the share falls as a contact leaves, or as nothing is heard
//   (let_go)
// Adachi 1993 and Mark et al. 1996 for the idea; the tank in place of Mark's fixed recovery time.
// Every call is realtime-safe. Contacts are sampled at X_WT before it and after it (FeltContact::here). `count` is that
// of the contacts felt, which share what a hand may feel of a step.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>

#include "haptic_core/contact/friction.h"
#include "haptic_core/local_model/seen_curvature.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::local_model {

struct FeltContact;

struct Transition {
  glm::dvec3 nhat_W{0};    ///< direction in use; turns towards the received one
  glm::dvec3 slope_W{0};   ///< slope in use; the same
  glm::dvec3 offset_W{0};  ///< added to the received point in use; moves towards zero [m]
  double recess_m = 0;     ///< subtracted from the depth, > 0 while energy is owed, < 0 while a force is let go
  double share = 1;        ///< of the stiffness
  bool is_leaving = false;
  /// While it leaves the felt depth does not exceed this; while a force is let go, unless the depth itself does.
  double most_m = std::numeric_limits<double>::infinity();
};

/// Of what is let in with a time constant: all where that is 0.
[[nodiscard]] inline double share_after(double dt_s, double time_constant_s) noexcept {
  return time_constant_s > 0 ? 1 - std::exp(-dt_s / time_constant_s) : 1;
}

/// Turns the direction and the slope and moves the point towards what was received, at constant stored energy.
void follow(FeltContact&, double dt_s, std::size_t count, const spatial::Pose& X_WT) noexcept;

/// What time lets in of one contact's depth, in one tick.
struct LetIn {
  double felt_m = 0, change_m = 0;
  double costs_J = 0;  ///< < 0: gives
  double gives_J = 0;  ///< already: what was let go does not grow
};
/// By slopes that lag behind, the depth would still swing as the tool did when it was told: so it is let in towards the
/// one of the linearisation as received.
[[nodiscard]] LetIn to_let_in(FeltContact&, double dt_s, std::size_t count, const spatial::Pose& X_WT) noexcept;
/// Lets in what share of its cost was paid.
void let_in(FeltContact&, const LetIn&, double share) noexcept;

struct LetGo {
  double gives_J = 0;
  bool is_gone = false;
};
/// One that leaves, of so many, lets go of its force.
[[nodiscard]] LetGo leave(FeltContact&, double dt_s, std::size_t leaving) noexcept;
/// Nothing is heard: the force goes to zero in a stated time.
[[nodiscard]] LetGo fade(FeltContact&, double dt_s, std::size_t count) noexcept;

/// One model at two poses: what is owed stays owed, direction, slope and point lag as far behind as they did. A depth
/// that jumps further than a texture can, or for longer than the tank may owe, and a point that jumps, are let in like
/// any update. Returns the energy that this gives; < 0: takes.
double go_on(const FeltContact& old, FeltContact& now, std::size_t count, double tank_level_J,
             const spatial::Pose& X_WT) noexcept;

/// What the contacts before an update hand on to one contact after it.
struct WarmStart {
  double force_N = 0;
  glm::dvec3 p_sum{0}, nhat_sum{0}, slope_sum{0};  ///< weighted by force
  glm::dvec3 friction_N{0};
  double friction_J = 0;
  bool is_sliding = false;
  double strongest_N = 0;
  SeenCurvature seen;    ///< of the strongest
  double no_room_m = 0;  ///< the greatest

  void add(const FeltContact& old) noexcept;
  /// The friction that goes on with the same force, as far as the successor can hold it and no energy is added.
  [[nodiscard]] contact::Friction friction(const glm::dvec3& nhat, const contact::FrictionLimits&) const noexcept;
};
/// Starts where the old force was, as strong as it was and as it pointed, but for a free step towards its own, of which
/// an answer that came since_s after the one before has a share. before: how many contacts were felt before the update.
/// Returns what it stores in friction then.
double begin(FeltContact&, const WarmStart&, double since_s, std::size_t before, std::size_t count,
             const spatial::Pose& X_WT) noexcept;

}  // namespace farfeel::local_model
