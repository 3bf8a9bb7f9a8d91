// The soft maximum as a sum over nodes: depth, gradient, curvature and contact point, accumulated one node at a time.
#pragma once

#include "haptic_core/penetration/facing_patch.h"

namespace farfeel::penetration {

/// Both surfaces over one point of C's plane, and how near it is to their edges.
struct SoftNode {
  glm::dvec2 uv_m;
  double area_m2;  ///< of the plane that the node stands for
  double overlap_m;
  HeightAlong t;
  double steepest;  ///< the steeper of the two surfaces' slopes there
  EdgeFade s_fade, t_fade;
  bool is_at_border;  ///< of the window
};

class SoftSum {
 public:
  /// first_m: a guess of the peak; nodes may exceed it. p_CTo_C: where T's origin is.
  SoftSum(double soft_width_m, double first_m, const glm::dvec3& p_CTo_C, bool wants_hessian);

  void add(const SoftNode&) noexcept;
  /// Unknown when nothing was added.
  [[nodiscard]] Penetration result() const noexcept;

 private:
  double w_m_, level_m_;  // weights are exp((overlap - level) / w)
  glm::dvec3 p_CTo_C_;
  bool wants_hessian_;
  double sum_ = 0, edge_sum_ = 0, border_sum_ = 0, steep_sum_ = 0;
  glm::dvec3 point_{0};
  spatial::Vector6 gradient_ = spatial::Vector6::Zero();
  spatial::Matrix6 square_ = spatial::Matrix6::Zero(), curvature_ = spatial::Matrix6::Zero();
};

}  // namespace farfeel::penetration
