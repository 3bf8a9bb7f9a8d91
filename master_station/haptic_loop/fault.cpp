#include "master_station/haptic_loop/fault.h"

namespace farfeel::master_station {

std::string_view message(Fault fault) noexcept {
  switch (fault) {
    case Fault::kNone:
      return "no fault";
    case Fault::kContactsNotUsable:
      return "the remote sent contacts that are not finite or not of a sane size; force is off until reset";
    case Fault::kDeviceNotFinite:
      return "the device reported a pose that is not finite; force is off: check its driver, then reset";
    case Fault::kDeviceTooFast:
      return "the device moved faster than it can; force is off: check cables and encoders, then reset";
    case Fault::kDeviceSilent:
      return "the device does not answer; force is off: plug it in and take hold of it, or reset";
    case Fault::kDeviceGivesWork:
      return "the device's force drove the hand on and on; force is off: let go and take hold again, or reset; where "
             "it comes again, check the device's axes and calibration";
    case Fault::kDeviceGoesElsewhere:
      return "the device does not go where its force pushes (axis or sign?); force is off: check the driver's axes and "
             "the calibration, then reset and take hold again";
    case Fault::kToolNotFinite:
      return "the simulated tool is not finite (a bug: please report it); force is off until reset";
    case Fault::kContactLost:
      return "a contact that pressed deep was gone at once: the shape cannot be felt there; force is off: let the tool "
             "out, then reset";
  }
  return "unknown fault";
}

std::string_view message(LoopState state) noexcept {
  switch (state) {
    case LoopState::kFree:
      return "free: nothing is touched";
    case LoopState::kTouching:
      return "touching";
    case LoopState::kHeld:
      return "held: news from the remote is 50 ms older than the link takes; the last surface is still felt";
    case LoopState::kFading:
      return "fading: news from the remote is 250 ms older than the link takes; force goes to zero until newer comes";
    case LoopState::kFault:
      return "fault: force is off";
    case LoopState::kPaused:
      return "paused: force is off; resume, then take hold of the handle anew: force comes back in a ramp";
  }
  return "unknown state";
}

}  // namespace farfeel::master_station
