// With weights p_i = area_i keep_i exp(d_i / w) and g_i, H_i the derivatives of d_i + w ln keep_i by T's pose:
//   depth = w ln(sum p_i / a0),   gradient = mean of g_i,   Hessian = mean of H_i + covariance of g_i / w.
#include "haptic_core/penetration/reference/soft_sum.h"

#include <cmath>

#include "haptic_core/penetration/pose_derivatives.h"

namespace farfeel::penetration {
namespace {

constexpr double kSteepest = 2.7475;      ///< slope of a surface that stands at 70 degrees
constexpr double kMostAboveLevel = 40;    ///< soft widths above the level before the sums are scaled down
constexpr double kSilhouetteShare = 0.5;  ///< of the weight near an edge: then the edge is what touches
constexpr double kDoubtfulShare = 0.01;

}  // namespace

SoftSum::SoftSum(double soft_width_m, double first_m, const glm::dvec3& p_CTo_C, bool wants_hessian)
    : w_m_(soft_width_m), level_m_(first_m), p_CTo_C_(p_CTo_C), wants_hessian_(wants_hessian) {}

void SoftSum::add(const SoftNode& node) noexcept {
  const double keep = node.s_fade.keep * node.t_fade.keep;
  if (!(keep > 0)) return;
  if (node.overlap_m - level_m_ > kMostAboveLevel * w_m_) {
    const double scale = std::exp((level_m_ - node.overlap_m) / w_m_);
    for (double* total : {&sum_, &edge_sum_, &border_sum_, &steep_sum_}) *total *= scale;
    point_ *= scale;
    gradient_ *= scale;
    square_ *= scale;
    curvature_ *= scale;
    level_m_ = node.overlap_m;
  }
  const double weight = node.area_m2 * keep * std::exp((node.overlap_m - level_m_) / w_m_);
  const glm::dvec3 Q{node.uv_m, node.t.z_m}, r = Q - p_CTo_C_;
  spatial::Vector6 g = overlap_gradient(node.t, r);
  spatial::Vector6 edge = spatial::Vector6::Zero();
  const double relative_slope = node.t_fade.keep_slope_1_per_m / node.t_fade.keep;
  if (node.t_fade.keep < 1) {
    edge = edge_distance_gradient(node.t_fade, node.t_fade.p_CFoot_C - p_CTo_C_);
    g += (w_m_ * relative_slope) * edge;
  }
  sum_ += weight;
  point_ += weight * Q;
  gradient_ += weight * g;
  if (keep < 0.999) edge_sum_ += weight;
  if (node.is_at_border) border_sum_ += weight;
  if (node.steepest > kSteepest) steep_sum_ += weight;
  if (!wants_hessian_) return;
  square_ += weight * g * g.transpose();
  curvature_ += weight * overlap_hessian(node.t, r);
  if (node.t_fade.keep < 1) {
    const double bend = node.t_fade.keep_curvature_1_per_m2 / node.t_fade.keep - relative_slope * relative_slope;
    curvature_ += (weight * w_m_ * bend) * edge * edge.transpose();
  }
}

Penetration SoftSum::result() const noexcept {
  if (!(sum_ > 0)) return {};
  Penetration answer;
  answer.depth_m = level_m_ + w_m_ * std::log(sum_ / kReferenceArea_m2);
  answer.p_CQ_C = point_ / sum_;
  answer.gradient = gradient_ / sum_;
  if (wants_hessian_) {
    answer.hessian = (square_ - gradient_ * gradient_.transpose() / sum_) / (w_m_ * sum_) + curvature_ / sum_;
  }
  const bool is_silhouette = edge_sum_ > kSilhouetteShare * sum_;
  answer.doubts = 0;
  if (is_silhouette) answer.doubts |= kSilhouette;
  if (!is_silhouette && border_sum_ > kDoubtfulShare * sum_) answer.doubts |= kBorder;
  if (steep_sum_ > kDoubtfulShare * sum_) answer.doubts |= kGrazing;
  return answer;
}

}  // namespace farfeel::penetration
