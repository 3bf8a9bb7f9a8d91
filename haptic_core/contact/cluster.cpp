#include "haptic_core/contact/cluster.h"

#include "haptic_core/contact/smooth_step.h"

namespace farfeel::contact {

double squareness(double facing) noexcept {
  constexpr double kNoneBelow = 0.45, kFullAbove = 0.8;
  return share_between(facing, kNoneBelow, kFullAbove);
}

}  // namespace farfeel::contact
