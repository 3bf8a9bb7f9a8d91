#include "haptic_core/contact/material.h"

#include <cmath>

namespace farfeel::contact {
namespace {

double in_series(double a, double b) {
  return a > 0 && b > 0 ? a * b / (a + b) : 0;
}

}  // namespace

Material combined(const Material& a, const Material& b) noexcept {
  return {.stiffness_N_per_m = in_series(a.stiffness_N_per_m, b.stiffness_N_per_m),
          .damping_Ns_per_m = in_series(a.damping_Ns_per_m, b.damping_Ns_per_m),
          .static_friction = std::sqrt(a.static_friction * b.static_friction),
          .dynamic_friction = std::sqrt(a.dynamic_friction * b.dynamic_friction)};
}

}  // namespace farfeel::contact
