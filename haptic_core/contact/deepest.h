// How deep a contact may be looked up: by the material behind its pieces. Deeper than half of that, the nearest way out
// leads through it.
#pragma once

#include <algorithm>

namespace farfeel::contact {

/// Of what is thick there; the rest to a half is for what the coarse mesh and a tick's way are off.
inline constexpr double kDeepestShare = 0.4;
/// Nothing is looked up deeper, however thick the material is: a face's neighbours turn away within millimetres [m].
inline constexpr double kDeepest_m = 2e-3;
/// Any contact may be looked up so deep: less is within what the coarse mesh is off [m].
inline constexpr double kLeastDeepest_m = 0.1e-3;

/// thickness_m: of the thinnest piece; infinite where none is known.
[[nodiscard]] inline double deepest_m(double thickness_m) noexcept {
  return std::clamp(kDeepestShare * thickness_m, kLeastDeepest_m, kDeepest_m);
}

}  // namespace farfeel::contact
