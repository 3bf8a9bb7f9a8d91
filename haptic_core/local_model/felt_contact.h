// One contact as it is felt: the received one, as far as it was let in, and what is remembered of its place.
//
// tangent.h says what its newest linearisation makes of it; the deepest of that and of what was told before and still
// holds is felt (kept_tangents.h; not where it stands in for tiles that are soon here). The newest is bent by the
// second derivative that the remote sent (rung 2), or by what two young answers tell of it along the way between them.
// Held until the next answer, the push back from a flank would come late by half the time between answers: a heavy tool
// in a groove swings for ever on that.
#pragma once

#include <algorithm>
#include <cstdint>

#include "haptic_core/contact/friction.h"
#include "haptic_core/local_model/kept_tangents.h"
#include "haptic_core/local_model/received_contact.h"
#include "haptic_core/local_model/seen_curvature.h"
#include "haptic_core/local_model/transition.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::local_model {

struct FeltContact {
  /// What it is at one tool pose.
  struct Sample {
    double depth_m;             ///< as the linearisation says, recess not subtracted
    spatial::Vector6 gradient;  ///< d depth / d (rotation, translation) of T about To, in W
    glm::dvec3 p_ToC_W;
    glm::dvec3 bend_slope_W;  ///< what B adds to the slope here
  };

  ReceivedContact received;
  Transition transition;
  KeptTangents kept;
  SeenCurvature seen;
  contact::Friction friction;
  spatial::Pose foreseen_W;  ///< the way of its object that it has gone along before it came
  /// Of constraints: from the proxy, which stays on the surface, to the tool, which sinks into the pad
  /// (model_rows.cpp).
  glm::dvec3 pad_W{0};
  /// Of constraints: depth at the proxy, which walls leave no room. Nobody moved into it, so recess goes there, not to
  /// 0.
  double no_room_m = 0;
  std::uint64_t row = 0;  ///< the row that it is to the solver; goes on with the contact; 0 before it is felt
  Sample here;            ///< at the model's tool pose: look_from() after every change of what it depends on

  /// The surface is looked up where the proxy of that tool is: the pad's way across a slope is no way along the
  /// surface.
  [[nodiscard]] Sample sample(const spatial::Pose& X_WT) const noexcept;
  /// Of a pose that is on the surface itself: one where something was looked up.
  [[nodiscard]] Sample sample_there(const spatial::Pose& X_W) const noexcept;
  void look_from(const spatial::Pose& X_WT) noexcept { here = sample(X_WT); }
  /// The depth where the proxy is, recess not subtracted.
  [[nodiscard]] double at_proxy_m() const noexcept { return here.depth_m + glm::dot(transition.nhat_W, pad_W); }
  [[nodiscard]] double felt_m(const Sample& at) const noexcept {
    return std::max(0.0, at.depth_m - transition.recess_m);
  }
  [[nodiscard]] double felt_m() const noexcept { return felt_m(here); }
  /// B's and the kept tangents' part of the second derivative there, in the gradient's coordinates.
  [[nodiscard]] spatial::Matrix6 bend_at(const spatial::Pose& X_WT) const noexcept;
  /// How much deeper the newest is there in use than it was received: where it still follows, it has other slopes.
  [[nodiscard]] double beyond_received_m(const spatial::Pose& X_WT) const noexcept;

  /// Its object has gone a way, and it goes along; the tool stays where it is.
  void go_along(const spatial::Pose& way_W) noexcept;
  /// It follows an older contact in its place: what that knew is kept, as far as it holds.
  void keep(const FeltContact& older) noexcept;

  [[nodiscard]] double stiffness_N_per_m() const noexcept {
    return transition.share * received.contact.material.stiffness_N_per_m;
  }
  [[nodiscard]] double damping_Ns_per_m() const noexcept {
    return transition.share * received.contact.material.damping_Ns_per_m;
  }
  /// Of the spring along the direction; friction's own comes on top.
  [[nodiscard]] double energy_J(double felt_m) const noexcept { return 0.5 * stiffness_N_per_m() * felt_m * felt_m; }
  [[nodiscard]] contact::FrictionLimits friction_limits(double felt_m) const noexcept {
    return contact::friction_limits(received.contact.material, stiffness_N_per_m() * felt_m, transition.share);
  }
  [[nodiscard]] double energy_with_friction_J(double felt_m) const noexcept {
    return energy_J(felt_m) + contact::friction_energy_J(friction, friction_limits(felt_m));
  }

 private:
  /// The newest linearisation in use, its point so much aside.
  [[nodiscard]] Tangent in_use(const glm::dvec3& aside_W) const noexcept;
};

/// As received, with nothing owed.
[[nodiscard]] FeltContact felt_contact(const ReceivedContact&) noexcept;
[[nodiscard]] inline FeltContact felt_contact(const contact::Contact& contact, const spatial::Pose& X0_WT) noexcept {
  return felt_contact(received(contact, X0_WT));
}

}  // namespace farfeel::local_model
