#include "haptic_core/local_model/received_contact.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/ablation/ablation.h"
#include "haptic_core/contact/depth/contact_frame.h"
#include "haptic_core/local_model/constants.h"
#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::local_model {
namespace {

using Eigen::Matrix3d;
using spatial::Matrix6;

/// Cut off at a length, and how the result follows what was cut.
struct Cut {
  glm::dvec3 value;
  Matrix3d by;
};
Cut cut(const glm::dvec3& v, double most) {
  const double length = glm::length(v);
  if (length <= most) return {v, Matrix3d::Identity()};
  const Eigen::Vector3d way = spatial::to_eigen(v / length);
  return {most / length * v, most / length * (Matrix3d::Identity() - way * way.transpose())};
}

/// The second derivative about To at X0 as one in (dtheta, m) about the contact point, without what the exact motion of
/// the point makes of a gradient, n.theta x (theta x r) and alike.
Matrix6 bend_about_point(const Matrix6& hessian, const glm::dvec3& p_ToC_W, const glm::dvec3& by_translation,
                         double range_m) {
  const Eigen::Vector3d r = spatial::to_eigen(p_ToC_W), g = spatial::to_eigen(by_translation);
  Matrix6 to_motion = Matrix6::Identity();  // of To, from the rotation and the motion of the point
  to_motion.bottomLeftCorner<3, 3>() = spatial::cross_matrix(p_ToC_W);
  Matrix6 bend = to_motion.transpose() * hessian * to_motion;
  bend.topLeftCorner<3, 3>() -= 0.5 * (g * r.transpose() + r * g.transpose()) - g.dot(r) * Matrix3d::Identity();
  const double turned = bend.bottomRightCorner<3, 3>().norm() * range_m;
  if (turned > kMaxSlope) bend *= kMaxSlope / turned;
  return bend;
}

double most_turn_rad(const Matrix6& bend) {
  const double couple_m_per_rad = bend.topLeftCorner<3, 3>().norm();
  return couple_m_per_rad > 0 ? kMaxCouple_m / couple_m_per_rad : 1e9;
}

}  // namespace

double news_s(double age_s) noexcept {
  if (ablated(Mechanism::kSlowNews)) return 0;
  return std::clamp(age_s - kYoung_s, 0.0, kSlowestNews_s);
}

ReceivedContact received(const contact::Contact& contact, const spatial::Pose& X0_WT, const Origin& origin) noexcept {
  const spatial::Twist gradient = spatial::twist_from(contact.gradient);  // the two halves, by name
  const glm::dvec3 n = contact.nhat_ST_W;
  const glm::dvec3 along = gradient.linear_m_s + n;
  const glm::dvec3 arm_part = glm::cross(contact.p_WC_W - X0_WT.p, gradient.linear_m_s);
  ReceivedContact received{.contact = contact, .X0_WT = X0_WT, .origin = origin};
  const glm::dvec3 slope = along - glm::dot(along, n) * n;
  received.slope_W = spatial::no_longer_than(kMaxSlope, slope);
  // A couple is a difference of arms times slopes: beside a wall it is nothing but rounding.
  if (glm::length(slope) <= kMaxSlope)
    received.couple_W = spatial::no_longer_than(kMaxCouple_m, gradient.angular_rad_s - arm_part);
  if (contact.curvature.is_known) {
    received.bend = bend_about_point(contact.curvature.matrix(), contact.p_WC_W - X0_WT.p, gradient.linear_m_s,
                                     contact.lateral_range_m);
    received.bend_range_m = contact.lateral_range_m;
  }
  return received;
}

ReceivedContact carried(const ReceivedContact& received, const spatial::Pose& way_W) noexcept {
  ReceivedContact carried = received;
  carried.contact = contact::carried(received.contact, way_W);
  carried.X0_WT = way_W * received.X0_WT;
  carried.slope_W = spatial::rotate(way_W, received.slope_W);
  carried.couple_W = spatial::rotate(way_W, received.couple_W);
  if (received.is_bent()) carried.bend = contact::turned(received.bend, way_W.R);
  return carried;
}

ReceivedContact bent_as_seen(const ReceivedContact& received, const ReceivedContact& older) noexcept {
  if (ablated(Mechanism::kBendAsSeen)) return received;
  const double range_m = received.contact.lateral_range_m;
  if (received.is_bent() || received.is_from_tiles() || older.is_from_tiles() || range_m > kTexture_m) return received;
  const Tangent now = received.tangent(), before = older.tangent();
  if (glm::dot(now.nhat_W, before.nhat_W) < kSameSideCosine ||
      glm::distance(now.p_TC_T(), before.p_TC_T()) > kSameSpot_m)
    return received;
  const glm::dvec3 m = now.p_WC_W - spatial::transform_point(before.X0_WT, now.p_TC_T());
  const glm::dvec3 l = m - glm::dot(m, now.nhat_W) * now.nhat_W;
  const double way_m = glm::length(l);
  if (!(way_m > kLeastSeenWay_m)) return received;
  const glm::dvec3 along = l / way_m;
  // What the tool's own turn makes of the gradient is no curvature.
  const double turned_rad = glm::length(spatial::vector_from_rotation(now.X0_WT.R * glm::conjugate(before.X0_WT.R)));
  const double turn = glm::dot(now.slope_W - now.nhat_W - before.slope_W + before.nhat_W, along) - turned_rad;
  if (!(turn > 0)) return received;
  ReceivedContact bent = received;
  bent.bend_range_m = std::min(range_m, kTurnsOn * way_m);
  const Eigen::Vector3d u = spatial::to_eigen(along);
  bent.bend.bottomRightCorner<3, 3>() = std::min(turn / way_m, kMaxSlope / bent.bend_range_m) * u * u.transpose();
  return bent;
}

ReceivedContact::Bent ReceivedContact::bent(const Tangent& tangent, const spatial::Pose& X_WT,
                                            const Tangent::Turned& by) const noexcept {
  Bent there{.at = tangent.at(X_WT, by)};
  if (!is_bent()) return there;
  const Cut turned = cut(there.at.turned_W, most_turn_rad(bend)), moved = cut(there.at.moved_W, bend_range_m);
  spatial::Vector6 q;
  q << spatial::to_eigen(turned.value), spatial::to_eigen(moved.value);
  const spatial::Vector6 v = bend * q;
  there.at.depth_m += 0.5 * q.dot(v);
  there.bend_slope_W = spatial::to_glm(Eigen::Vector3d(moved.by * v.tail<3>()));
  there.bend_slope_W -= glm::dot(there.bend_slope_W, tangent.nhat_W) * tangent.nhat_W;
  there.at.gradient += spatial::to_vector6(spatial::Twist{
      glm::cross(there.at.p_ToC_W, there.bend_slope_W) + spatial::to_glm(turned.by * v.head<3>()), there.bend_slope_W});
  return there;
}

// Without the turn of the cuts themselves, which only matters where they end.
Matrix6 ReceivedContact::bend_at(const Tangent& tangent, const spatial::Pose& X_WT,
                                 const Tangent::Turned& by) const noexcept {
  const glm::dvec3 &p_WC = tangent.p_WC_W, p_ToC = by.by * (p_WC - X0_WT.p);
  const glm::dvec3 m = X_WT.p + p_ToC - p_WC;
  const Eigen::Vector3d n = spatial::to_eigen(tangent.nhat_W);
  const Matrix3d across = Matrix3d::Identity() - n * n.transpose();
  const Matrix3d moved = cut(m - glm::dot(m, tangent.nhat_W) * tangent.nhat_W, bend_range_m).by * across;
  Matrix6 to_q = Matrix6::Zero();  // from (rotation, translation) of T about To
  to_q.topLeftCorner<3, 3>() = cut(by.theta_W, most_turn_rad(bend)).by;
  to_q.bottomLeftCorner<3, 3>() = -moved * spatial::cross_matrix(p_ToC);
  to_q.bottomRightCorner<3, 3>() = moved;
  return to_q.transpose() * bend * to_q;
}

bool is_usable(const contact::ContactSet& set) noexcept {
  if (set.count > contact::kMaxContacts || !spatial::is_valid(set.X_WT) || !spatial::is_finite(set.F_To_W))
    return false;
  return std::all_of(set.contacts.begin(), set.contacts.begin() + set.count, [](const contact::Contact& contact) {
    const contact::Material& m = contact.material;
    const auto is_within = [](double value, double low, double high) { return value >= low && value <= high; };
    return spatial::is_finite(contact.p_WC_W) && std::abs(glm::length(contact.nhat_ST_W) - 1) <= kUnitSlack &&
           is_within(contact.gradient.norm(), 0, kMostGradient) &&
           is_within(contact.depth_m, -kMostDepth_m, kMostDepth_m) &&
           is_within(contact.lateral_range_m, 0, kMostDepth_m) &&
           is_within(m.stiffness_N_per_m, 0, kMostStiffness_N_per_m) &&
           is_within(m.damping_Ns_per_m, 0, kMostDamping_Ns_per_m) && is_within(m.static_friction, 0, kMostFriction) &&
           is_within(m.dynamic_friction, 0, kMostFriction);
  });
}

}  // namespace farfeel::local_model
