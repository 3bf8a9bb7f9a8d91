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

// Hajian & Howe, J. Biomech. Eng. 119(1), 1997, found 255 - 1255 N/m, 4 - 7.4 Ns/m and some grams for a finger tip
// under 2 - 20 N; a hand on a tool is of that order, stiffer and heavier as it grips harder. The rotational values give
// the hand's stiffness an arm of 45 mm, half the width of a palm.
inline constexpr Grip kSoftGrip{"soft", 250, 4, 0.5, 0.008, 0.02};
inline constexpr Grip kMediumGrip{"medium", 500, 6, 1.0, 0.012, 0.05};
inline constexpr Grip kHardGrip{"hard", 1200, 10, 2.5, 0.02, 0.1};

[[nodiscard]] constexpr std::optional<Grip> find_grip(std::string_view name) {
  for (const Grip& grip : {kSoftGrip, kMediumGrip, kHardGrip})
    if (grip.name == name) return grip;
  return std::nullopt;
}

}  // namespace farfeel::master_station
