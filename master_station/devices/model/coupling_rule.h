// How stiff a coupling a device renders calmly in any hand, from its own figures. With b the device's viscous friction,
// B the coupling's damping, T the tick and t_delay from a movement to the force that answers it, the tick's hold apart,
//
//   K = 0.8 (b + B) / (T/2 + t_delay),   B = 0 without delay, else b/4
//
// A sampled spring is passive for every hand up to b / (T/2) without delay (Colgate & Schenkel, J. Rob. Sys. 14(1),
// 1997), where damping of its own only takes from that: b - B. A delayed one is calm in a hand that damps nothing up to
// 0.9 to 1.0 (b + B) / (T/2 + t_delay), for B up to b/2: simulated, as 'farfeel-bench stability' does. 0.8 keeps a
// margin from that; a hand that is known to be limp, or that would rather have it stiff, takes 0.85 and B = b/2.
#pragma once

#include <string>

#include "master_station/devices/device.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

enum class Grasp : std::uint8_t {
  kAny,
  kLimp  ///< stiffer and more damped: it adds nothing to either
};

/// At a tick of 1 ms, as the hand feels it.
struct Coupling {
  double stiffness_N_per_m = 0, damping_Ns_per_m = 0;
  double stiffness_Nm_per_rad = 0, damping_Nms_per_rad = 0;  ///< 0: the device cannot turn the hand, and bounds nothing
  bool is_identified = false;                                ///< stated by the data: the rule was not asked
};

/// From a movement to the force that answers it: sensor, actuator, and an exchange of its own, which does not wait for
/// the tick: whatever their phase, a command goes out with the exchange after the one that brought its sample.
[[nodiscard]] double delay_s(const DeviceModel&) noexcept;

/// The model with what is only estimated at the softer end: friction at half, delays half as long again.
[[nodiscard]] DeviceModel at_softer_end(const DeviceModel&);

/// What the data states, or the rule at the softer end of what it estimates.
[[nodiscard]] Coupling coupling_of(const DeviceModel&, Grasp = Grasp::kAny);

/// For a person at start-up: how stiff, why, and what of it rests on estimates.
[[nodiscard]] std::string in_words(const DeviceModel&, const Coupling&, Grasp = Grasp::kAny);

/// What the loop takes. Views the model's name, which outlives it.
[[nodiscard]] master_station::DeviceCapabilities capabilities_of(const DeviceModel&, Grasp = Grasp::kAny);

}  // namespace farfeel::devices
