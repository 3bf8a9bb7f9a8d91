// How deep a contact may be looked up: by the material behind its pieces. Deeper than half of that, the nearest way out
// leads through it.
#pragma once

#include <algorithm>

#include "haptic_core/contact/tracking/constants.h"

namespace farfeel::contact {

/// thickness_m: of the thinnest piece; infinite where none is known.
[[nodiscard]] inline double deepest_m(double thickness_m) noexcept {
  return std::clamp(kDeepestShare * thickness_m, kLeastDeepest_m, kDeepest_m);
}

}  // namespace farfeel::contact
