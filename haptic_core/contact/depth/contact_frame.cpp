#include "haptic_core/contact/depth/contact_frame.h"

#include <cmath>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/depth/constants.h"

namespace farfeel::contact {

using spatial::Pose;

Pose contact_frame(const Cluster& cluster) noexcept {
  const glm::dquat off_axes{std::cos(0.5 * kOffAxes_rad), 0, 0, std::sin(0.5 * kOffAxes_rad)};
  if (ablated(Mechanism::kOffAxes)) return {spatial::frame_with_z(cluster.nhat_ST_S), cluster.p_S};
  return {spatial::frame_with_z(cluster.nhat_ST_S) * off_axes, cluster.p_S};
}

bool is_credible(const penetration::Penetration& in_C) noexcept {
  return in_C.is_known() && std::isfinite(in_C.depth_m) && in_C.gradient.tail<3>().norm() < kSteepestCredible &&
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

}  // namespace farfeel::contact
