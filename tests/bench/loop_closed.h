// Closed loop in simulated time: a hand that strokes, the simulated device, the haptic loop with its coupling, tool,
// local model and tank, the link, the remote. And the same with the surface itself in the local model's place.
#pragma once

#include "haptic_core/local_model/local_model.h"
#include "tests/bench/octaves.h"
#include "tests/bench/stroked_scenes.h"
#include "tests/bench/strokes.h"
#include "transport/link/link_spec.h"

namespace farfeel::bench {

struct ClosedLoop {
  OctavePowers contact{}, hand{};  ///< of the model's force on the tool, and of the force on the hand, while stroking
  double largest_step_N = 0;       ///< of the force on the hand, from tick to tick, while stroking
  double ripple_share = 0;         ///< above 20 Hz over the mean, held still, from 1 s after the strokes on
  double device_min_J = 0;         ///< least that the hand had put into the device
  double actuators_min_J = 0;      ///< least that the device had put into its actuators
  /// Least that the tool had put into the contacts, with what the tank was allowed for nothing; and the design's bound.
  double contact_min_J = 0, contact_bound_J = 0;
  bool is_sound = true;  ///< finite, and no fault
};

struct HandProgram {
  std::vector<Stroke> strokes;
  double start_m;
};

[[nodiscard]] ClosedLoop stroke_through_link(const StrokedScene&, const HandProgram&, local_model::Rung,
                                             local_model::ContactLaw, double tick_hz, const transport::LinkSpec&);
/// The remote's own surface at every tick and no link, under the coupling of the same rate.
[[nodiscard]] ClosedLoop stroke_on_truth(const StrokedScene&, const HandProgram&, double tick_hz);

/// No limit cycle, no fault, and no more than twice the truth's power while stroking.
[[nodiscard]] bool is_stable(const ClosedLoop&, const ClosedLoop& truth);

}  // namespace farfeel::bench
