// How a hand holds a handle: a spring and damper in six degrees of freedom, and some mass.
#pragma once

#include <optional>
#include <string_view>

namespace farfeel::master_station {

/// Second-order model of a hand that does not react within its reflex time.
struct Grip {
  std::string_view name;
  double stiffness_N_per_m, damping_Ns_per_m;
  double rotational_stiffness_Nm_per_rad, rotational_damping_Nms_per_rad;
  double mass_kg;  ///< of the hand that moves with the handle
};

// Of the order of published second-order fits, which grow stiffer and more damped with the force of the grip: Hajian &
// Howe, J. Biomech. Eng. 119(1), 1997 (finger tip); Hasser & Cutkosky, Haptics 2002 (a knob in a pinch). Chosen to span
// that order, not fitted to anybody. The rotational values give the stiffness an arm of 45 mm, half a palm's width.
inline constexpr Grip kSoftGrip{"soft", 250, 4, 0.5, 0.008, 0.02};
inline constexpr Grip kMediumGrip{"medium", 500, 6, 1.0, 0.012, 0.05};
inline constexpr Grip kHardGrip{"hard", 1200, 10, 2.5, 0.02, 0.1};

[[nodiscard]] constexpr std::optional<Grip> find_grip(std::string_view name) {
  for (const Grip& grip : {kSoftGrip, kMediumGrip, kHardGrip})
    if (grip.name == name) return grip;
  return std::nullopt;
}

}  // namespace farfeel::master_station
