// The source's gradient: the depth at the pose and at ten poses around it. Kept as the historical comparator.
// Otaduy, Jain, Sud and Lin 2004, section 5.3: central differences in the five degrees of freedom that are not the
// direction itself (two translations across it, three rotations); along it the derivative is -1 by definition.
#pragma once

#include <array>

#include "haptic_core/penetration/back_end.h"

namespace farfeel::penetration {

struct DifferenceSteps {
  double translation_m = 25e-6;
  double rotation_rad = 1e-3;
};

/// The query itself, then two for each coordinate, forwards and backwards.
[[nodiscard]] std::array<Query, 11> queries_around(const Query&, const DifferenceSteps&) noexcept;
/// From the answers to these.
[[nodiscard]] Penetration gradient_from(const std::array<Penetration, 11>&, const DifferenceSteps&) noexcept;

/// Depth, contact point and doubts from the back end's own answer; the gradient from differences. Realtime-safe.
[[nodiscard]] Penetration eleven_evaluations(BackEnd&, const Query&, const DifferenceSteps&) noexcept;

}  // namespace farfeel::penetration
