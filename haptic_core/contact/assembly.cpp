#include "haptic_core/contact/assembly.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/contact/penalty.h"

namespace farfeel::contact {

using spatial::Pose;

namespace {

/// Of C about the direction, against the axes that the direction alone would give. Depths are summed over nodes on C's
/// lattice. S's axes are often those of its texture, and a lattice along a periodic texture meets the same phases again
/// and again, so that its nodes' errors do not make up for each other. This angle is far from those of squares, of
/// triangles and of simple slopes: its tangent is the golden ratio less one.
constexpr double kOffAxes_rad = 0.55357435889704525;

}  // namespace

Pose contact_frame(const Cluster& cluster) noexcept {
  const glm::dquat off_axes{std::cos(0.5 * kOffAxes_rad), 0, 0, std::sin(0.5 * kOffAxes_rad)};
  return {spatial::frame_with_z(cluster.nhat_ST_S) * off_axes, cluster.p_S};
}

// Felt surfaces lie within 60 degrees of facing along the direction, so no true slope is larger than 1 / cos 60 and a
// little for texture. What is, comes from a sum that hardly any weight is left in.
bool is_credible(const penetration::Penetration& in_C) noexcept {
  constexpr double kSteepest = 4;
  return in_C.is_known() && std::isfinite(in_C.depth_m) && in_C.gradient.tail<3>().norm() < kSteepest &&
         in_C.gradient.allFinite();
}

Contact contact_from(const Cluster& cluster, const penetration::Penetration& in_C, const Pose& X_WS,
                     const glm::dvec3& p_WTo) noexcept {
  const Pose X_WC = X_WS * contact_frame(cluster);
  Contact contact;
  contact.nhat_ST_W = spatial::rotate(X_WC, {0, 0, 1});
  contact.doubts = static_cast<std::uint8_t>(in_C.doubts & kAllDoubts);
  if (is_credible(in_C)) {
    contact.p_WC_W = spatial::transform_point(X_WC, in_C.p_CQ_C);
    contact.depth_m = in_C.depth_m;
    const spatial::Wrench g_C = spatial::wrench_from(in_C.gradient);
    contact.gradient =
        spatial::to_vector6(spatial::Wrench{spatial::rotate(X_WC, g_C.torque_Nm), spatial::rotate(X_WC, g_C.force_N)});
  } else {
    contact.p_WC_W = X_WC.p;
    contact.depth_m = cluster.depth_m;
    contact.gradient = spatial::to_vector6(
        spatial::Wrench{-glm::cross(contact.p_WC_W - p_WTo, contact.nhat_ST_W), -contact.nhat_ST_W});
  }
  return contact;
}

spatial::Matrix6 turned(const spatial::Matrix6& in_C, const glm::dquat& R_WC) noexcept {
  Eigen::Matrix3d R;
  for (int k = 0; k < 3; ++k) R.col(k) = spatial::to_eigen(R_WC * glm::dvec3{k == 0, k == 1, k == 2});
  spatial::Matrix6 both = spatial::Matrix6::Zero();
  both.topLeftCorner<3, 3>() = R;
  both.bottomRightCorner<3, 3>() = R;
  return both * in_C * both.transpose();
}

void sum_wrench(ContactSet& set, const spatial::Twist& V_WT_W, const motion::MovingObjects& moving) noexcept {
  set.F_To_W = {};
  for (std::uint32_t i = 0; i < set.count; ++i) {
    spatial::Twist V_ST_W = V_WT_W;
    if (const motion::Moved* moved = moving.find(set.contacts[i].object)) {
      const spatial::Twist V_WS_W = moved->twist_at(set.X_WT.p);
      V_ST_W = {V_ST_W.angular_rad_s - V_WS_W.angular_rad_s, V_ST_W.linear_m_s - V_WS_W.linear_m_s};
    }
    set.F_To_W = set.F_To_W + penalty_wrench(set.contacts[i], V_ST_W);
  }
}

}  // namespace farfeel::contact
