#include "haptic_core/penetration/simd/finished_sums.h"

#include <algorithm>
#include <cmath>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {
namespace {

constexpr double kSilhouetteShare = 0.5;  ///< of the weight near an edge: then the edge is what touches
constexpr double kDoubtfulShare = 0.01;
/// An answer is flagged that so many standard deviations of its sum move by more than either.
constexpr double kSpreads = 2, kTolerable_m = 0.5e-6, kTolerableShare = 0.005;
/// Variance of a sum over a lattice whose nodes see a texture by chance, of that over as many places anywhere.
constexpr double kOfChance = 0.5;

}  // namespace

// The nodes in one cell were drawn together: so their noise adds up as amounts do, and not as squares.
double Spread::of(const simd::Sums& sums) const noexcept {
  const double together = drawn_m > 0 ? std::max(drawn_m * drawn_m / (step_m * step_m), 1.0) : 0;
  return std::sqrt(together * std::max(sums.noise, 0.0) + kOfChance * rough * sums.squares) / sums.weight;
}

Penetration finished(const simd::Sums& sums, double level_m, double width_m, bool wants_hessian,
                     const Spread& by_chance) noexcept {
  if (!(sums.weight > 0)) return {};
  Penetration answer;
  answer.depth_m = level_m + width_m * std::log(sums.weight / kReferenceArea_m2);
  answer.p_CQ_C = glm::dvec3{sums.point[0], sums.point[1], sums.point[2]} / sums.weight;
  for (int k = 0; k < 5; ++k) answer.gradient[k] = sums.gradient[k] / sums.weight;
  answer.gradient[5] = -1;
  if (wants_hessian) {
    for (int i = 0, k = 0; i < 5; ++i) {
      for (int j = 0; j <= i; ++j, ++k) {
        const double spread = sums.square[k] / sums.weight - answer.gradient[i] * answer.gradient[j];
        answer.hessian(i, j) = answer.hessian(j, i) = spread / width_m + sums.curvature[k] / sums.weight;
      }
    }
  }
  const bool is_silhouette = sums.edge > kSilhouetteShare * sums.weight;
  answer.doubts = 0;
  if (is_silhouette) answer.doubts |= kSilhouette;
  if (!is_silhouette && sums.border > kDoubtfulShare * sums.weight) answer.doubts |= kBorder;
  if (sums.steep > kDoubtfulShare * sums.weight) answer.doubts |= kGrazing;
  const double off_m = kSpreads * width_m * by_chance.of(sums);
  if (off_m > std::max(kTolerable_m, kTolerableShare * std::abs(answer.depth_m))) answer.doubts |= kCoarseSteps;
  return answer;
}

}  // namespace farfeel::penetration
