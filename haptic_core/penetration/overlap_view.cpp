#include "haptic_core/penetration/overlap_view.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "haptic_core/penetration/pose_derivatives.h"

namespace farfeel::penetration {
namespace {

constexpr int kNewtonSteps = 12;
constexpr double kSteepest = 2.7475;  ///< slope of a surface that stands at 70 degrees

}  // namespace

bool OverlapView::at(const glm::dvec2& uv, Overlap& overlap) const noexcept {
  const Facet* s_facet = s.facet_at(uv);
  const Facet* t_facet = s_facet ? t.facet_at(uv) : nullptr;
  return t_facet && of(*s_facet, *t_facet, uv, overlap);
}

bool OverlapView::of(const Facet& s_facet, const Facet& t_facet, const glm::dvec2& uv,
                     Overlap& overlap) const noexcept {
  if (coarse_overlap_m(s_facet, t_facet, uv) > deepest_m) return false;
  overlap.s = s.height_at(s_facet, uv);
  overlap.t = t.height_at(t_facet, uv);
  overlap.d_m = overlap.s.z_m - overlap.t.z_m;
  if (std::isnan(overlap.d_m)) return false;
  overlap.slope = {overlap.s.z_u - overlap.t.z_u, overlap.s.z_v - overlap.t.z_v};
  overlap.d_uu = overlap.s.z_uu_1_per_m - overlap.t.z_uu_1_per_m;
  overlap.d_uv = overlap.s.z_uv_1_per_m - overlap.t.z_uv_1_per_m;
  overlap.d_vv = overlap.s.z_vv_1_per_m - overlap.t.z_vv_1_per_m;
  return true;
}

Peak OverlapView::climb(const glm::dvec2& start, const Window& window, const glm::dvec2& longest_step_m,
                        bool to_the_edge) const noexcept {
  Peak peak;
  peak.uv = start;
  if (!at(start, peak.at)) return peak;
  const double longest_step = glm::length(longest_step_m);
  double stride = 1;
  for (int step = 0; step < kNewtonSteps; ++step) {
    const Overlap& here = peak.at;
    const double determinant = here.d_uu * here.d_vv - here.d_uv * here.d_uv;
    glm::dvec2 move;
    if (here.d_uu < 0 && determinant > 0) {
      move = glm::dvec2{here.d_uv * here.slope.y - here.d_vv * here.slope.x,
                        here.d_uv * here.slope.x - here.d_uu * here.slope.y} /
             determinant;
    } else {
      const double slope = glm::length(here.slope);
      if (!(slope > 0)) break;
      move = here.slope * (0.5 * longest_step / slope);
    }
    const double length = glm::length(move);
    if (length > longest_step) move *= longest_step / length;
    // Halve until it climbs; what cannot climb has arrived, or stands at an edge.
    bool has_climbed = false;
    for (stride = 1; stride > 1e-6; stride *= 0.5) {
      const glm::dvec2 uv = glm::clamp(peak.uv + stride * move, window.low, window.high);
      Overlap next;
      if (at(uv, next) && next.d_m > peak.at.d_m) {
        peak.uv = uv;
        peak.at = next;
        has_climbed = true;
        break;
      }
      if (stride * length < 1e-9) break;
    }
    if (!has_climbed) break;
  }
  peak.is_inside = glm::length(peak.at.slope) < 1e-6 + 1e-7 * peak.at.bend();
  if (peak.is_inside || !to_the_edge) return peak;
  // An edge holds it: walk along whatever direction still climbs, with ever shorter steps.
  const glm::dvec2 corner_step = longest_step_m * 0.5;
  for (double scale = 1; scale * longest_step > 1e-9;) {
    const glm::dvec2 s_in = s.fade_at(peak.uv).inward, t_in = t.fade_at(peak.uv).inward;
    const std::array<glm::dvec2, 4> ways{glm::dvec2{corner_step.x, 0}, glm::dvec2{0, corner_step.y},
                                         0.5 * longest_step * glm::dvec2{-s_in.y, s_in.x},
                                         0.5 * longest_step * glm::dvec2{-t_in.y, t_in.x}};
    bool has_climbed = false;
    for (const glm::dvec2& way : ways) {
      for (const double turn : {scale, -scale}) {
        const glm::dvec2 uv = glm::clamp(peak.uv + turn * way, window.low, window.high);
        Overlap next;
        if (at(uv, next) && next.d_m > peak.at.d_m) {
          peak.uv = uv;
          peak.at = next;
          has_climbed = true;
        }
      }
    }
    if (!has_climbed) scale *= 0.5;
  }
  return peak;
}

Penetration OverlapView::hard_maximum(const Query& query, const Peak& peak) const noexcept {
  Penetration answer;
  answer.doubts = 0;
  answer.depth_m = peak.at.d_m;
  answer.p_CQ_C = {peak.uv, peak.at.t.z_m};
  const glm::dvec3 r = answer.p_CQ_C - query.t.X_CO.p;
  const double s_keep = s.fade_at(peak.uv).keep, t_keep = t.fade_at(peak.uv).keep;
  // Where T's edge holds the peak the contact travels with T: S's slope counts, at S's edge T's.
  answer.gradient = overlap_gradient(!peak.is_inside && t_keep < s_keep ? peak.at.s : peak.at.t, r);
  if (query.wants_hessian && peak.is_inside) {
    const Matrix62 slopes = overlap_gradient_slopes(peak.at.t, r);
    const double determinant = peak.at.d_uu * peak.at.d_vv - peak.at.d_uv * peak.at.d_uv;
    answer.hessian = overlap_hessian(peak.at.t, r);
    if (determinant > 0) {  // the peak moves with T: subtract what that adds
      Eigen::Matrix2d inverse;
      inverse << peak.at.d_vv, -peak.at.d_uv, -peak.at.d_uv, peak.at.d_uu;
      answer.hessian -= slopes * (inverse / determinant) * slopes.transpose();
    }
  }
  if (!peak.is_inside && std::min(s_keep, t_keep) < 1) answer.doubts |= kSilhouette;
  const double steepness = std::max(glm::length(glm::dvec2{peak.at.s.z_u, peak.at.s.z_v}),
                                    glm::length(glm::dvec2{peak.at.t.z_u, peak.at.t.z_v}));
  if (steepness > kSteepest) answer.doubts |= kGrazing;
  const glm::dvec2 inside = glm::min(peak.uv - query.window.low, query.window.high - peak.uv);
  if (!peak.is_inside && std::min(inside.x, inside.y) < 1e-9) answer.doubts |= kBorder;
  return answer;
}

}  // namespace farfeel::penetration
