// One hand, one device, one flat wall somewhere else, and the ways to feel it across a delay.
#pragma once

#include <string_view>

#include "haptic_core/local_model/local_model.h"
#include "master_station/devices/grip.h"

namespace farfeel::bench {

enum class Method {
  kOurs,          ///< local model of linearised contacts, coupling, tank
  kOursMidpoint,  ///< the same, the tool's step by the midpoint rule in place of backward Euler
  kHeldWrench,    ///< the remote's wrench, held between messages, on the same coupling and tool
  kDirect,        ///< the remote's wrench straight to the hand
  kWave,          ///< wave variables to a tool at the remote
  kTimeDomain,    ///< time-domain passivity: velocity goes, force comes, each end's controller dissipates
};
[[nodiscard]] std::string_view name(Method);
/// Has the loop's local model.
[[nodiscard]] constexpr bool has_model(Method method) {
  return method == Method::kOurs || method == Method::kOursMidpoint || method == Method::kHeldWrench;
}

struct Setting {
  Method method;
  master_station::Grip grip;
  double tool_mass_kg;  ///< where the method has a tool
  double tick_hz;
  double round_trip_s;
  double wall_N_per_m;                                                  ///< of the wall's material, over the whole tool
  local_model::ContactLaw contact = local_model::ContactLaw::kPenalty;  ///< of ours
};

struct Press {
  bool is_stable = false;        ///< the design's word: ripple above 20 Hz below 5 % of the mean, from 1 s on
  double displayed_N_per_m = 0;  ///< mean force on the hand over the handle's depth, by the true pose
  double ripple_share = 0;
  double device_min_J = 0;  ///< least energy that the hand had put in
  /// Least energy that the tool had put into the local model, with the tank's stated allowance, and the design's bound
  /// of it, K (v T)^2 / 2 of one held tick; ours and the held wrench alone have that port.
  double contact_min_J = 0, contact_bound_J = 0;
};

/// The hand waits above the wall until the link has answered, then pushes its intent 3 N deep at once.
[[nodiscard]] Press press(const Setting&);

}  // namespace farfeel::bench
