// A shared library of the kind of farfeel_device.h, loaded and looked over once.
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/plug_in/farfeel_device.h"

namespace farfeel::devices {

/// Stays loaded until the process ends: a plug-in may have threads, and their code must not go away.
struct PlugInLibrary {
  std::string path;  ///< with every link followed
  std::string name;  ///< as the plug-in calls itself, for messages
  const farfeel_device_plug_in* table = nullptr;
};

/// Fails, with a message that says which, where there is no such file; where somebody else could have put it there (the
/// file and its folder have to belong to this user or to root, and neither group nor others may write to them); where
/// it is no library that this machine can load, or no plug-in; where it is made for another version; where its table
/// lacks a function that it must have.
[[nodiscard]] tl::expected<PlugInLibrary, DeviceError> load_plug_in(const std::string& path);

/// All *.so in $XDG_CONFIG_HOME/farfeel/plug-ins or ~/.config/farfeel/plug-ins, by name. None where there is no folder.
[[nodiscard]] std::vector<std::string> installed_plug_ins();

}  // namespace farfeel::devices
