// One contact as it is felt between two messages from the remote: linear along the surface, unilateral, and honest
// about how far it was meant to hold.
//
// The remote gave depth d0 and gradient g at the tool pose X0. The gradient splits into the direction and a slope:
// g_translation = -n + G with G.n = 0, and g_rotation = r x g_translation + c, where c is what an extended contact adds
// to the arm r. With m the exact rigid motion of the contact point since X0, m_n = n.m its normal and l its tangential
// part, dtheta the rotation since X0, and s = min(1, range / |l|):
//   depth = d0 - m_n + s (G.l + c.dtheta)
// Where the remote sent the depth's second derivative too (rung 2), B of it in (dtheta, m) about the contact point adds
// to this: + q.B q / 2 with q = (t dtheta, s l); the part of B that the exact motion m makes is left out.
// Beyond lateral_range the slope's rise stays what it is at the range's edge: a linearisation of a ridge, followed for
// a round trip, would otherwise rise without end.
#pragma once

#include <limits>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/friction.h"
#include "haptic_core/local_model/seen_curvature.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::local_model {

/// A slope beyond 2 is a wall beside the contact, not its texture: followed, it would turn a contact of k into one of
/// k (1 + slope^2).
inline constexpr double kMaxSlope = 2;
inline constexpr double kMaxCouple_m = 0.1;
/// B is held so that within the lateral range it turns no slope by more than kMaxSlope, and t so that it turns no
/// couple by more than kMaxCouple_m: a soft maximum's curvature is true of its width alone.

struct FeltContact {
  contact::Contact at_X0;                            ///< as received
  spatial::Pose X0_WT;                               ///< the pose it was linearised at
  glm::dvec3 nhat_W{0};                              ///< direction in use; moves towards at_X0.nhat_ST_W
  glm::dvec3 slope_W{0};                             ///< G in use; moves towards slope_goal_W
  glm::dvec3 slope_goal_W{0}, couple_W{0};           ///< G and c as received, at most kMaxSlope and kMaxCouple_m long
  spatial::Matrix6 bend = spatial::Matrix6::Zero();  ///< B, where at_X0.curvature is known
  SeenCurvature seen;
  glm::dvec3 offset_W{0};  ///< added to at_X0.p_WC_W in use; moves towards zero [m]
  double recess_m = 0;     ///< subtracted from the depth, > 0 while energy is owed, < 0 while a force is let go
  double share = 1;        ///< of the stiffness, 1 .. 0 as it leaves
  contact::Friction friction;
  spatial::Pose foreseen_W;  ///< the way of its object that it has gone along before it came
  bool is_leaving = false;
  /// While it leaves the felt depth does not exceed this; while a force is let go, unless the depth itself does.
  double most_m = std::numeric_limits<double>::infinity();
  bool is_from_tiles = false;  ///< evaluated, not linearised by the remote

  /// What it is at one tool pose.
  struct Sample {
    double depth_m;             ///< as the linearisation says, recess not subtracted
    double felt_m;              ///< max(0, depth - recess)
    spatial::Vector6 gradient;  ///< d depth / d (rotation, translation) of T about To, in W
    glm::dvec3 p_ToC_W;
    glm::dvec3 bend_slope_W{0};  ///< what B adds to the slope here
  };
  [[nodiscard]] Sample sample(const spatial::Pose& X_WT) const noexcept;
  /// B's part of the second derivative there, in the gradient's coordinates.
  [[nodiscard]] spatial::Matrix6 bend_at(const spatial::Pose& X_WT) const noexcept;

  /// Its object has gone a way, and it goes along; the tool stays where it is.
  void go_along(const spatial::Pose& way_W) noexcept;

  [[nodiscard]] bool is_bent() const noexcept { return at_X0.curvature.is_known; }
  [[nodiscard]] double stiffness_N_per_m() const noexcept { return share * at_X0.material.stiffness_N_per_m; }
  [[nodiscard]] double damping_Ns_per_m() const noexcept { return share * at_X0.material.damping_Ns_per_m; }
  /// Of the spring along the direction; friction's own comes on top.
  [[nodiscard]] double energy_J(double felt_m) const noexcept { return 0.5 * stiffness_N_per_m() * felt_m * felt_m; }
  [[nodiscard]] contact::FrictionLimits friction_limits(double felt_m) const noexcept {
    return contact::friction_limits(at_X0.material, stiffness_N_per_m() * felt_m, share);
  }
  [[nodiscard]] double energy_with_friction_J(double felt_m) const noexcept {
    return energy_J(felt_m) + contact::friction_energy_J(friction, friction_limits(felt_m));
  }
};

/// As received, with nothing owed.
[[nodiscard]] FeltContact felt_contact(const contact::Contact&, const spatial::Pose& X0_WT) noexcept;

}  // namespace farfeel::local_model
