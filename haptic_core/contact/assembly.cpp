#include "haptic_core/contact/assembly.h"

#include <cmath>

#include "haptic_core/contact/penalty.h"

namespace farfeel::contact {

using spatial::Pose;

Pose contact_frame(const Cluster& cluster) noexcept {
  return {spatial::frame_with_z(cluster.nhat_ST_S), cluster.p_S};
}

namespace {

/// Felt surfaces lie within 60 degrees of facing along the direction, so no true slope is larger than 1 / cos 60 and a
/// little for texture. What is, comes from a sum that hardly any weight is left in.
bool is_credible(const penetration::Penetration& in_C) {
  constexpr double kSteepest = 4;
  return in_C.is_known() && std::isfinite(in_C.depth_m) && in_C.gradient.tail<3>().norm() < kSteepest &&
         in_C.gradient.allFinite();
}

}  // namespace

Contact contact_from(const Cluster& cluster, const penetration::Penetration& in_C, const Pose& X_WS,
                     const glm::dvec3& p_WTo) noexcept {
  const Pose X_WC = X_WS * contact_frame(cluster);
  Contact contact;
  contact.nhat_ST_W = spatial::rotate(X_WC, {0, 0, 1});
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

std::uint32_t without_repeats(std::span<Contact> contacts, double apart_m) noexcept {
  constexpr double kSameDirection = 0.9;  // cos 25 degrees
  const auto repeats = [&](const Contact& a, const Contact& b) {
    return a.object == b.object && glm::distance(a.p_WC_W, b.p_WC_W) < apart_m &&
           glm::dot(a.nhat_ST_W, b.nhat_ST_W) > kSameDirection;
  };
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    std::uint32_t same = 0;
    while (same < kept && !repeats(contacts[same], contacts[i])) ++same;
    if (same == kept) {
      contacts[kept++] = contacts[i];
    } else if (contacts[i].depth_m > contacts[same].depth_m) {
      contacts[same] = contacts[i];
    }
  }
  return kept;
}

void sum_wrench(ContactSet& set, const spatial::Twist& V_WT_W) noexcept {
  set.F_To_W = {};
  for (std::uint32_t i = 0; i < set.count; ++i) set.F_To_W = set.F_To_W + penalty_wrench(set.contacts[i], V_WT_W);
}

}  // namespace farfeel::contact
