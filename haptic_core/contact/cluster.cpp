#include "haptic_core/contact/cluster.h"

#include <algorithm>

namespace farfeel::contact {

double squareness(double facing) noexcept {
  constexpr double kNoneBelow = 0.45, kFullAbove = 0.8;
  const double x = std::clamp((facing - kNoneBelow) / (kFullAbove - kNoneBelow), 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

}  // namespace farfeel::contact
