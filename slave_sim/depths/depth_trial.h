// How long back ends take for a usual frame on this machine.
#pragma once

#include "haptic_core/penetration/back_end.h"

namespace farfeel::slave_sim {

/// Seven contacts of crossed ridges, N = 50, sliding at 10 mm/s: the median time of a frame [us].
[[nodiscard]] double trial_us(penetration::BackEnd&, std::size_t frames);

inline constexpr penetration::Limits kTrialLimits{.coarse_triangles = 16};

}  // namespace farfeel::slave_sim
