// Every device that is plugged in, as `farfeel device list` tells it: to a person, as JSON, and to the station.
//
// For the station (--machine), one line a device, fields apart by one tab each, none of which holds a tab or a newline:
//     model  serial  path  force_dof  tells  trouble
// force_dof: 0 to 3, how many axes can push. tells: "pose" or "rate". trouble: empty where the device can be opened,
// else why not and what to do. The order is the one in which "auto" takes them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

/// How the support of every driver here is proven. No driver has met its hardware.
inline constexpr const char* kProof = "emulated; never run on hardware";

/// find_model, or a test's.
using ModelLookup = const DeviceModel* (*)(std::string_view name);

struct ListedDevice {
  FoundDevice found;
  std::string family;  ///< of the driver
  DeviceModel model;   ///< a name alone where there is no data of the model
  bool has_data = false;
};

/// Asks every family. What a device says of itself comes without control characters: it goes to terminals.
[[nodiscard]] std::vector<ListedDevice> listed_devices(std::span<const DriverFamily>, const DriverOptions&,
                                                       ModelLookup);

/// What is wrong with what a person typed for NAME[:SERIAL], in words; empty: a driver is called so, or a device that
/// is plugged in now. Which of them is plugged in is not asked for: that is waited for.
[[nodiscard]] std::string trouble_with_name(std::string_view typed, std::span<const DriverFamily>,
                                            const DriverOptions&);

/// "pose of 3, force of 3": what it tells and what it gives.
[[nodiscard]] std::string abilities(const DeviceModel&);

[[nodiscard]] std::string list_for_person(std::span<const ListedDevice>, std::span<const DriverFamily>);
[[nodiscard]] std::string list_as_json(std::span<const ListedDevice>, std::span<const DriverFamily>);
[[nodiscard]] std::string list_for_station(std::span<const ListedDevice>);

}  // namespace farfeel::devices
