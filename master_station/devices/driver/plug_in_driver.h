// A device behind somebody else's shared library: plug_in/farfeel_device.h.
//
// The library is DriverOptions::plug_in; where that is empty, every *.so in ~/.config/farfeel/plug-ins. It runs in this
// process with all its rights, so it has to belong to this user or to root, and nobody else may be able to change it.
#pragma once

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/plug_in/plug_in_library.h"

namespace farfeel::devices {

extern const DriverFamily kPlugInFamily;

/// A library that cannot be loaded is found, too, with its trouble.
[[nodiscard]] std::vector<FoundDevice> find_plug_in_devices(const DriverOptions&);
/// Opens one. Its steps answer kFault, without force, from the first value on that no device can have, until it is
/// opened anew. After any step that was not kReady force waits for a command without it.
[[nodiscard]] tl::expected<std::unique_ptr<Driver>, DeviceError> open_plug_in_device(const FoundDevice&,
                                                                                     const DriverOptions&);

}  // namespace farfeel::devices
