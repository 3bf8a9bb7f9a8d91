// The back end on a graphics device: every contact of a frame in one dispatch of compute shaders, and with them those
// of every other session that asked at the same time.
#pragma once

#include "haptic_core/penetration/back_end.h"
#include "haptic_core/penetration/egl/device.h"

namespace farfeel::penetration::egl {

/// How the back end's answers came about, since it was made.
struct Tally {
  std::uint64_t by_device = 0, by_simd = 0;  ///< contacts
  double prepare_us = 0;                     ///< of the last frame: projecting and writing its contacts
  FrameTimes last;                           ///< of the last frame that the device answered
};

/// Soft and hard maxima and raw grids, in float, on the device; sums and candidates are finished by the code that
/// finishes simd's. Answers agree with the
/// converged integral within 0.2 um and 0.025 of the direction (within 1 um where the window cuts a contact off). What
/// the device does not answer, for whatever reason (it is lost, late, full, or was not given the surface by prepare()),
/// the simd back end inside answers at once.
class EglBackEnd : public BackEnd {
 public:
  [[nodiscard]] virtual Tally tally() const = 0;
};

/// Null when the device's rings are all taken.
[[nodiscard]] std::unique_ptr<EglBackEnd> make_egl(std::shared_ptr<Device>, const Limits&);

/// For ContactOptions::maker; a session that finds all rings taken gets the simd back end.
[[nodiscard]] BackEndMaker egl_maker(std::shared_ptr<Device>);

}  // namespace farfeel::penetration::egl
