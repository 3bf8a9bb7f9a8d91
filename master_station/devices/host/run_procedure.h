// A procedure with a real person at the terminal and a real device behind its owner.
#pragma once

#include <functional>
#include <memory>

#include "master_station/devices/host/commands.h"
#include "master_station/devices/host/procedure.h"
#include "master_station/devices/model/device_file.h"

namespace farfeel::devices {

/// The device that was opened, as its model and its own file tell.
struct OpenedFigures {
  DeviceModel model;      ///< without the device's own file
  DeviceFile file;        ///< with it
  std::string path;       ///< of that file, there or not
  bool has_data = false;  ///< the program knows the model
};

struct RunSettings {
  double cap_N = 0;
  bool applies_calibration = true;  ///< samples and forces are in B; else in the driver's own frame
};

/// Opens the device, waits until it is ready, and steps what `make` gives for it, until that is over or a person ends
/// it. Returns the exit status. `make` may say why not (nullptr, and a message printed by itself).
[[nodiscard]] int run_procedure(
    const Hardware&, const std::function<std::unique_ptr<Procedure>(const OpenedFigures&, RunSettings&)>& make);

}  // namespace farfeel::devices
