// The slow obvious back end, with its accuracy as a choice: the same code, finer, is the truth of the benchmarks.
#pragma once

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {

struct ReferenceOptions {
  double steps_per_width = 1;        ///< quadrature steps per standard deviation of the sharpest peak
  double tail_widths = 14;           ///< cells this many soft widths below the peak are left out
  std::size_t most_nodes = 100'000;  ///< of the refined quadrature; met, the step grows and kCoarseSteps is set
};

/// Converged to about 1e-3 of a soft width, with 200 samples a side and more, for truth: far too slow for a loop.
inline constexpr ReferenceOptions kTruth{.steps_per_width = 2, .tail_widths = 18, .most_nodes = 2'000'000};

[[nodiscard]] std::unique_ptr<BackEnd> make_reference(const Limits&, const ReferenceOptions& = {});
[[nodiscard]] BackEndMaker reference_maker(const ReferenceOptions& = {});

}  // namespace farfeel::penetration
