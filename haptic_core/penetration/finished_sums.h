// What the sums over a soft maximum's cells say, whoever added them up.
#pragma once

#include "haptic_core/penetration/penetration.h"
#include "haptic_core/penetration/simd_kernels.h"

namespace farfeel::penetration {

/// Depth, point, derivatives and doubts from sums of weights exp((overlap - level) / width). Unknown without weight.
[[nodiscard]] Penetration finished(const simd::Sums&, double level_m, double width_m, bool wants_hessian) noexcept;

}  // namespace farfeel::penetration
