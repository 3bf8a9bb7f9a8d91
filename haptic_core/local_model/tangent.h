// A contact's depth as one linearisation of it says, and honest about how far that was meant to hold.
//
// Told were depth d0 and gradient g at the tool pose X0. The gradient splits into the direction and a slope:
// g_translation = -n + G with G.n = 0, and g_rotation = r x g_translation + c, where c is what an extended contact adds
// to the arm r. With m the exact rigid motion of the contact point since X0, m_n = n.m its normal and l its tangential
// part, dtheta the rotation since X0, and s = min(1, range / |l|):
//   depth = d0 - m_n + s (G.l + c.dtheta) - fall max(0, |l| - range)
// Beyond the range the slope's rise stays what it is at the range's edge: a linearisation of a ridge, followed for a
// round trip, would otherwise rise without end.
#pragma once

#include "haptic_core/spatial/spatial.h"

namespace farfeel::local_model {

struct Tangent {
  spatial::Pose X0_WT;
  glm::dvec3 p_WC_W{0}, nhat_W{0};
  glm::dvec3 slope_W{0}, couple_W{0};  ///< G and c
  double depth_m = 0;                  ///< at X0
  double range_m = 0;
  double fall = 0;  ///< how steeply the surface is taken to fall away beyond the range

  /// What it says of one tool pose.
  struct At {
    double depth_m;
    spatial::Vector6 gradient;  ///< d depth / d (rotation, translation) of T about To, in W
    glm::dvec3 p_ToC_W;
    glm::dvec3 turned_W, moved_W;  ///< dtheta and l
  };
  [[nodiscard]] At at(const spatial::Pose& X_WT) const noexcept { return at(X_WT, turned_to(X_WT)); }

  /// How far a tool pose is turned from X0.
  struct Turned {
    glm::dquat by;
    glm::dvec3 theta_W;
  };
  [[nodiscard]] Turned turned_to(const spatial::Pose& X_WT) const noexcept;
  /// at(), where that is known from another tangent at the same X0.
  [[nodiscard]] At at(const spatial::Pose& X_WT, const Turned&) const noexcept;

  /// In T: the place of the tool that it speaks of.
  [[nodiscard]] glm::dvec3 p_TC_T() const noexcept { return glm::conjugate(X0_WT.R) * (p_WC_W - X0_WT.p); }
  /// Its object has gone a way, and it goes along; the tool stays where it is.
  void go_along(const spatial::Pose& way_W) noexcept;
};

}  // namespace farfeel::local_model
