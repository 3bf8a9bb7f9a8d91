// One contact as it is felt between two messages from the remote: linear along the surface, unilateral, and honest
// about how far it was meant to hold.
//
// tangent.h says what its newest linearisation makes of it; the deepest of that and of what was told before and still
// holds is felt (kept_tangents.h; not where it stands in for tiles that are soon here). Where the remote sent the
// depth's second derivative too (rung 2), B of it in (dtheta, m) about the contact point adds to the newest: + q.B q /
// 2 with q = (t dtheta, s l); the part of B that the exact motion m makes is left out. Where it did not, two young
// answers tell B along the way between them. Held until the next one, the push back from a flank would come late by
// half the time between answers: a heavy tool in a groove swings for ever on that.
#pragma once

#include <cmath>
#include <limits>

#include "haptic_core/contact/contact_set.h"
#include "haptic_core/contact/friction.h"
#include "haptic_core/local_model/kept_tangents.h"
#include "haptic_core/local_model/seen_curvature.h"
#include "haptic_core/local_model/tangent.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::local_model {

/// A slope beyond 2 is a wall beside the contact, not its texture: followed, it would turn a contact of k into one of
/// k (1 + slope^2).
inline constexpr double kMaxSlope = 2;
inline constexpr double kMaxCouple_m = 0.1;
inline constexpr double kSlowestNews_s = 0.03;  ///< of FeltContact::news_s, which the oldest answers have
/// B is held so that within the lateral range it turns no slope by more than kMaxSlope, and t so that it turns no
/// couple by more than kMaxCouple_m: a soft maximum's curvature is true of its width alone.

struct FeltContact {
  contact::Contact at_X0;                            ///< as received
  spatial::Pose X0_WT;                               ///< the pose it was linearised at
  glm::dvec3 nhat_W{0};                              ///< direction in use; moves towards at_X0.nhat_ST_W
  glm::dvec3 slope_W{0};                             ///< G in use; moves towards slope_goal_W
  glm::dvec3 slope_goal_W{0}, couple_W{0};           ///< G and c as received, at most kMaxSlope and kMaxCouple_m long
  spatial::Matrix6 bend = spatial::Matrix6::Zero();  ///< B, told or seen
  double bend_range_m = 0;                           ///< how far along the surface B holds; 0: not at all
  KeptTangents kept;
  SeenCurvature seen;
  glm::dvec3 offset_W{0};  ///< added to at_X0.p_WC_W in use; moves towards zero [m]
  double recess_m = 0;     ///< subtracted from the depth, > 0 while energy is owed, < 0 while a force is let go
  double news_s = 0;       ///< time constant with which it follows what was received, at least
  double share = 1;        ///< of the stiffness, 1 .. 0 as it leaves
  contact::Friction friction;
  spatial::Pose foreseen_W;  ///< the way of its object that it has gone along before it came
  bool is_leaving = false;
  /// While it leaves the felt depth does not exceed this; while a force is let go, unless the depth itself does.
  double most_m = std::numeric_limits<double>::infinity();
  bool is_from_tiles = false;    ///< evaluated, not linearised by the remote
  bool is_from_outline = false;  ///< and that with heights of the outline: not all are at hand
  double off_m = 0;              ///< how far from the true depth that is, at most

  /// What it is at one tool pose.
  struct Sample {
    double depth_m;             ///< as the linearisation says, recess not subtracted
    double felt_m;              ///< max(0, depth - recess)
    spatial::Vector6 gradient;  ///< d depth / d (rotation, translation) of T about To, in W
    glm::dvec3 p_ToC_W;
    glm::dvec3 bend_slope_W{0};  ///< what B adds to the slope here
  };
  [[nodiscard]] Sample sample(const spatial::Pose& X_WT) const noexcept;
  /// B's and the kept tangents' part of the second derivative there, in the gradient's coordinates.
  [[nodiscard]] spatial::Matrix6 bend_at(const spatial::Pose& X_WT) const noexcept;

  /// The newest linearisation in use, its point so much aside; and one with B, at a pose turned so from X0.
  [[nodiscard]] Tangent in_use(const glm::dvec3& aside_W) const noexcept;
  struct Newest {
    Tangent::At at;
    glm::dvec3 bend_slope_W{0};
  };
  [[nodiscard]] Newest bent(const Tangent&, const spatial::Pose& X_WT, const Tangent::Turned&) const noexcept;
  /// How much deeper the newest is there in use than it was told: where it still follows, it has other slopes.
  [[nodiscard]] double beyond_told_m(const spatial::Pose& X_WT) const noexcept;

  /// Its object has gone a way, and it goes along; the tool stays where it is.
  void go_along(const spatial::Pose& way_W) noexcept;

  /// The newest linearisation, as received.
  [[nodiscard]] Tangent told() const noexcept {
    return {X0_WT, at_X0.p_WC_W, at_X0.nhat_ST_W, slope_goal_W, couple_W, at_X0.depth_m, at_X0.lateral_range_m};
  }
  /// It follows an older contact in its place: what that knew is kept, as far as it holds.
  void keep(const FeltContact& older) noexcept {
    if (is_from_tiles || older.is_from_tiles) return;
    kept = older.kept;
    kept.keep(older.told(), told(), news_s > 0);
  }

  /// It follows an older answer for the same place: as the gradient turned between them along the surface, it turns on,
  /// where the depth grows by that. What it turned the other way pushes off late, and so calms.
  void bend_as_seen(const FeltContact& older) noexcept;

  [[nodiscard]] bool is_bent() const noexcept { return bend_range_m > 0; }
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

/// Of what is let in with a time constant: all where that is 0.
[[nodiscard]] inline double share_after(double dt_s, double time_constant_s) noexcept {
  return time_constant_s > 0 ? 1 - std::exp(-dt_s / time_constant_s) : 1;
}

/// As received, with nothing owed.
[[nodiscard]] FeltContact felt_contact(const contact::Contact&, const spatial::Pose& X0_WT) noexcept;

}  // namespace farfeel::local_model
