#include "haptic_core/local_model/felt_contact.h"

#include <algorithm>

#include "haptic_core/contact/assembly.h"
#include "haptic_core/spatial/no_longer_than.h"

namespace farfeel::local_model {
namespace {

// Of two answers that speak of one place, and so tell how the slope turns there.
constexpr double kSameSideCosine = 0.94;  // 20 degrees
constexpr double kSamePlace_m = 2e-3;     // of the tool; texture moves the point of a contact by less
constexpr double kLeastWay_m = 1e-6;      // between them; below, a turn is rounding
constexpr double kTexture_m = 1e-3;       // lateral range: where it is further, edges and corners turn the slope
constexpr double kTurnsOn = 2;            // ways, as a tool that has just turned back goes further than it came

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

FeltContact felt_contact(const contact::Contact& contact, const spatial::Pose& X0_WT) noexcept {
  const spatial::Twist gradient = spatial::twist_from(contact.gradient);  // the two halves, by name
  const glm::dvec3 n = contact.nhat_ST_W;
  const glm::dvec3 along = gradient.linear_m_s + n;
  const glm::dvec3 arm_part = glm::cross(contact.p_WC_W - X0_WT.p, gradient.linear_m_s);
  FeltContact felt;
  felt.at_X0 = contact;
  felt.X0_WT = X0_WT;
  felt.nhat_W = n;
  const glm::dvec3 slope = along - glm::dot(along, n) * n;
  felt.slope_W = felt.slope_goal_W = spatial::no_longer_than(kMaxSlope, slope);
  // A couple is a difference of arms times slopes: beside a wall it is nothing but rounding.
  if (glm::length(slope) <= kMaxSlope)
    felt.couple_W = spatial::no_longer_than(kMaxCouple_m, gradient.angular_rad_s - arm_part);
  if (contact.curvature.is_known) {
    felt.bend = bend_about_point(contact.curvature.matrix(), contact.p_WC_W - X0_WT.p, gradient.linear_m_s,
                                 contact.lateral_range_m);
    felt.bend_range_m = contact.lateral_range_m;
  }
  return felt;
}

void FeltContact::bend_as_seen(const FeltContact& older) noexcept {
  if (is_bent() || is_from_tiles || older.is_from_tiles || at_X0.lateral_range_m > kTexture_m) return;
  const Tangent now = told(), before = older.told();
  if (glm::dot(now.nhat_W, before.nhat_W) < kSameSideCosine ||
      glm::distance(now.p_TC_T(), before.p_TC_T()) > kSamePlace_m)
    return;
  const glm::dvec3 m = now.p_WC_W - spatial::transform_point(before.X0_WT, now.p_TC_T());
  const glm::dvec3 l = m - glm::dot(m, now.nhat_W) * now.nhat_W;
  const double way_m = glm::length(l);
  if (!(way_m > kLeastWay_m)) return;
  const glm::dvec3 along = l / way_m;
  // What the tool's own turn makes of the gradient is no curvature.
  const double turned_rad = glm::length(spatial::vector_from_rotation(now.X0_WT.R * glm::conjugate(before.X0_WT.R)));
  const double turn = glm::dot(now.slope_W - now.nhat_W - before.slope_W + before.nhat_W, along) - turned_rad;
  if (!(turn > 0)) return;
  bend_range_m = std::min(at_X0.lateral_range_m, kTurnsOn * way_m);
  const Eigen::Vector3d u = spatial::to_eigen(along);
  bend.bottomRightCorner<3, 3>() = std::min(turn / way_m, kMaxSlope / bend_range_m) * u * u.transpose();
}

Tangent FeltContact::in_use(const glm::dvec3& aside_W) const noexcept {
  return {X0_WT, at_X0.p_WC_W + aside_W, nhat_W, slope_W, couple_W, at_X0.depth_m, at_X0.lateral_range_m};
}

FeltContact::Newest FeltContact::bent(const Tangent& tangent, const spatial::Pose& X_WT,
                                      const Tangent::Turned& by) const noexcept {
  Newest newest{.at = tangent.at(X_WT, by)};
  if (!is_bent()) return newest;
  const Cut turned = cut(newest.at.turned_W, most_turn_rad(bend)), moved = cut(newest.at.moved_W, bend_range_m);
  spatial::Vector6 q;
  q << spatial::to_eigen(turned.value), spatial::to_eigen(moved.value);
  const spatial::Vector6 v = bend * q;
  newest.at.depth_m += 0.5 * q.dot(v);
  newest.bend_slope_W = spatial::to_glm(Eigen::Vector3d(moved.by * v.tail<3>()));
  newest.bend_slope_W -= glm::dot(newest.bend_slope_W, tangent.nhat_W) * tangent.nhat_W;
  newest.at.gradient += spatial::to_vector6(
      spatial::Twist{glm::cross(newest.at.p_ToC_W, newest.bend_slope_W) + spatial::to_glm(turned.by * v.head<3>()),
                     newest.bend_slope_W});
  return newest;
}

double FeltContact::beyond_told_m(const spatial::Pose& X_WT) const noexcept {
  if (!(news_s > 0)) return 0;
  const Tangent::Turned by = told().turned_to(X_WT);
  return bent(in_use(offset_W), X_WT, by).at.depth_m - bent(told(), X_WT, by).at.depth_m;
}

FeltContact::Sample FeltContact::sample(const spatial::Pose& X_WT) const noexcept {
  const Tangent::Turned by = in_use(offset_W).turned_to(X_WT);
  Newest newest = bent(in_use(offset_W), X_WT, by);
  Tangent::At& at = newest.at;
  if (!kept.is_empty() && offset_W == glm::dvec3(0)) {
    kept.join(at, X_WT);
  } else if (!kept.is_empty()) {
    // The offset is the whole contact's: it adds to the maximum what it adds to the newest, and chooses nothing.
    const Tangent::At aside = at;
    at = bent(in_use(glm::dvec3(0)), X_WT, by).at;
    const Tangent::At straight = at;
    kept.join(at, X_WT);
    at.depth_m += aside.depth_m - straight.depth_m;
    at.gradient += aside.gradient - straight.gradient;
    at.p_ToC_W += aside.p_ToC_W - straight.p_ToC_W;
  }
  return {.depth_m = at.depth_m,
          .felt_m = std::max(0.0, at.depth_m - recess_m),
          .gradient = at.gradient,
          .p_ToC_W = at.p_ToC_W,
          .bend_slope_W = newest.bend_slope_W};
}

void FeltContact::go_along(const spatial::Pose& way_W) noexcept {
  at_X0 = contact::carried(at_X0, way_W);
  X0_WT = way_W * X0_WT;
  for (glm::dvec3* v : {&nhat_W, &slope_W, &slope_goal_W, &couple_W, &offset_W, &friction.stretch_W})
    *v = spatial::rotate(way_W, *v);
  if (is_bent()) bend = contact::turned(bend, way_W.R);
  kept.go_along(way_W);
  seen.turn(way_W.R);
}

// Without the turn of the cuts themselves, which only matters where they end.
Matrix6 FeltContact::bend_at(const spatial::Pose& X_WT) const noexcept {
  Matrix6 by_kept = Matrix6::Zero();
  const Tangent::Turned by = in_use(offset_W).turned_to(X_WT);
  if (!kept.is_empty()) by_kept = kept.bend_at(bent(in_use(glm::dvec3(0)), X_WT, by).at, X_WT);
  if (!is_bent()) return by_kept;
  const glm::dvec3 p_WC = at_X0.p_WC_W + offset_W, p_ToC = by.by * (p_WC - X0_WT.p);
  const glm::dvec3 m = X_WT.p + p_ToC - p_WC;
  const Eigen::Vector3d n = spatial::to_eigen(nhat_W);
  const Matrix3d across = Matrix3d::Identity() - n * n.transpose();
  const Matrix3d moved = cut(m - glm::dot(m, nhat_W) * nhat_W, bend_range_m).by * across;
  Matrix6 to_q = Matrix6::Zero();  // from (rotation, translation) of T about To
  to_q.topLeftCorner<3, 3>() = cut(by.theta_W, most_turn_rad(bend)).by;
  to_q.bottomLeftCorner<3, 3>() = -moved * spatial::cross_matrix(p_ToC);
  to_q.bottomRightCorner<3, 3>() = moved;
  return to_q.transpose() * bend * to_q + by_kept;
}

}  // namespace farfeel::local_model
