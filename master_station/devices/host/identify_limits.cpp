#include "master_station/devices/host/limits_steps.h"
#include "master_station/devices/host/run_procedure.h"
#include "master_station/devices/host/written_procedure.h"

namespace farfeel::devices {

int identify_limits(const Hardware& hardware, bool has_consent) {
  return run_procedure(hardware, [&](const OpenedFigures& opened, RunSettings& settings) {
    auto procedure = std::make_unique<WrittenProcedure<LimitsSteps>>(opened, has_consent);
    settings.cap_N = procedure->cap_N();
    return procedure;
  });
}

}  // namespace farfeel::devices
