#include "master_station/devices/host/calibration_steps.h"
#include "master_station/devices/host/run_procedure.h"
#include "master_station/devices/host/written_procedure.h"

namespace farfeel::devices {

int calibrate(const Hardware& hardware) {
  return run_procedure(hardware, [](const OpenedFigures& opened, RunSettings& settings) {
    auto procedure = std::make_unique<WrittenProcedure<CalibrationSteps>>(opened);
    settings.cap_N = procedure->cap_N();
    settings.applies_calibration = false;
    return procedure;
  });
}

}  // namespace farfeel::devices
