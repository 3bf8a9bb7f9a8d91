// How a surface answers to being pressed.
#pragma once

namespace farfeel::contact {

/// Of one surface, or of two in contact. Every field >= 0.
struct Material {
  double stiffness_N_per_m = 2000;
  double damping_Ns_per_m = 0.5;
  double static_friction = 0.3;    ///< coefficient [1]
  double dynamic_friction = 0.25;  ///< coefficient [1], <= static_friction
};

/// Two surfaces pressed together: springs and dampers in series; friction by the geometric mean.
[[nodiscard]] Material combined(const Material&, const Material&) noexcept;

}  // namespace farfeel::contact
