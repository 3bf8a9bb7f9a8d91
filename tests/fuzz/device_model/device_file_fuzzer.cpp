// Any text as a device's file: refused with a message, or figures that a device can have, and the same again from its
// own words. And any bytes as a serial number: a name of one file.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "master_station/devices/model/coupling_rule.h"
#include "master_station/devices/model/device_file.h"
#include "master_station/devices/model/figures.h"

using namespace farfeel::devices;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  const std::string name = device_file_name("m", text);
  if (name.find('/') != std::string::npos || name.find('\0') != std::string::npos || name.size() > 255) std::abort();

  const DeviceModel& base = *find_model("simulated-late");
  const auto device = parse_device_file(text, "d.toml", base);
  if (!device) {
    if (device.error().message.empty()) std::abort();
    return 0;
  }
  for (const Figure& figure : kFigures) {
    const double value = device->model.*figure.member;
    if (!(value >= figure.least && value <= figure.most)) std::abort();
  }
  const Coupling coupling = coupling_of(device->model);
  if (!std::isfinite(coupling.stiffness_N_per_m) || coupling.stiffness_N_per_m < 0) std::abort();
  (void)in_words(device->model, coupling);
  const auto again = parse_device_file(device_file_text(*device, base), "d.toml", base);
  if (!again || !(again->calibration == device->calibration)) std::abort();
  for (const Figure& figure : kFigures) {
    if (again->model.*figure.member != device->model.*figure.member) std::abort();
  }
  return 0;
}
