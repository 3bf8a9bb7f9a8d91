// What the sums over a soft maximum's cells say, whoever added them up.
#pragma once

#include "haptic_core/penetration/penetration.h"
#include "haptic_core/penetration/simd/simd_kernels.h"

namespace farfeel::penetration {

/// Where a sum is off by chance.
struct Spread {
  double drawn_m = 0;  ///< how wide cells were when some were first drawn to stand for the others; 0: all are there
  double step_m = 0;   ///< of the nodes that were summed
  double rough = 0;    ///< share of what touches whose texture is finer than the step, so that nodes see it by chance

  /// Standard deviation of the sum, as a share of it.
  [[nodiscard]] double of(const simd::Sums&) const noexcept;
};

/// Depth, point, derivatives and doubts from sums of weights exp((overlap - level) / width). Unknown without weight.
/// kCoarseSteps is set where twice the sum's spread moves the depth by more than 0.5 um and 0.5 %.
[[nodiscard]] Penetration finished(const simd::Sums&, double level_m, double width_m, bool wants_hessian,
                                   const Spread& by_chance = {}) noexcept;

}  // namespace farfeel::penetration
