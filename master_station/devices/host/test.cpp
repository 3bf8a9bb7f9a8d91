#include <fmt/format.h>

#include "master_station/devices/host/force_test.h"
#include "master_station/devices/host/run_procedure.h"

namespace farfeel::devices {

int test(const Hardware& hardware, bool has_consent) {
  return run_procedure(hardware, [&](const OpenedFigures& opened, RunSettings& settings) {
    auto procedure = std::make_unique<ForceTest>(opened.file.model, has_consent);
    settings.cap_N = procedure->force_N();
    return procedure;
  });
}

}  // namespace farfeel::devices
