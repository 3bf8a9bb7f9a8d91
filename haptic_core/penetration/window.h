// How large a contact is: the part of C's plane that the penetration depth can come from.
#pragma once

#include <optional>

#include "haptic_core/penetration/facing_patch.h"

namespace farfeel::penetration {

inline constexpr Window kWholePlane{{-1e3, -1e3}, {1e3, 1e3}};

class WindowFinder {
 public:
  explicit WindowFinder(const Limits& limits) : s_(limits), t_(limits) {}

  /// The smallest box that holds every point of `outer` where the felt overlap may come within tail_m of its greatest,
  /// judged by the coarse triangles and what their texture can add. Nothing when the patches share no part of `outer`.
  /// Exact and cheap: the overlap of two triangles is linear, so corners of clipped polygons decide. Realtime-safe.
  [[nodiscard]] std::optional<Window> fit(const Patch& s, const Patch& t, const Window& outer, double tail_m,
                                          double deepest_m) noexcept;

  /// Both patches, projected over `outer` by the last fit().
  [[nodiscard]] const FacingPatch& s() const { return s_; }
  [[nodiscard]] const FacingPatch& t() const { return t_; }

 private:
  FacingPatch s_, t_;
};

}  // namespace farfeel::penetration
