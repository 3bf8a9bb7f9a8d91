// What a plug-in says, checked: nothing of it is used before. Each function fails with what was wrong.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "master_station/devices/driver/driver.h"
#include "master_station/devices/model/device_model.h"
#include "master_station/devices/plug_in/farfeel_device.h"

namespace farfeel::devices {

/// The device as this library calls it: FoundDevice::path is "LIBRARY#ID".
[[nodiscard]] tl::expected<FoundDevice, std::string> checked(const farfeel_device_found&, const std::string& library);
/// The way back, for open(). Fails where the path has no #, or parts too long.
[[nodiscard]] tl::expected<farfeel_device_found, std::string> found_again(const FoundDevice&);
/// LIBRARY of "LIBRARY#ID".
[[nodiscard]] std::string library_of(const std::string& path);

/// Every figure finite (holds_force_s may be infinite), within what a device can be, and in agreement with the others:
/// no force without a degree of freedom for it, a workspace with a volume where positions are measured.
[[nodiscard]] tl::expected<DeviceModel, std::string> checked(const farfeel_device_description&,
                                                             const std::string& name);
/// As a file of model/ would have it: all figures; the name is the file's.
[[nodiscard]] std::string toml(const DeviceModel&);

/// What is wrong in a sample after one that had `before`; null: nothing. Allocates nothing.
[[nodiscard]] const char* fault_of(const farfeel_device_sample& sample, const farfeel_device_sample& before,
                                   std::int64_t now_ns) noexcept;
/// A sample without fault, in our words; the orientation is normalised. V_BD_B only where it has one.
[[nodiscard]] Sample sample_from(const farfeel_device_sample&) noexcept;

/// What is wrong; null: nothing.
[[nodiscard]] const char* fault_of(const farfeel_device_zero_force&) noexcept;

}  // namespace farfeel::devices
