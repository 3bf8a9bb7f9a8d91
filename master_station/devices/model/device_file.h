// What a person's own device differs in from its model: calibration, and figures measured on it, in a TOML file for
// each serial number. Set-up only: files are read and written here.
//
//   coupling_stiffness_N_per_m = 1400     # any figure of the model
//   [calibration]
//   axes = ["+x", "-z", "+y"]             # B's x, y and z, each as the driver's axis that it is
//   units_per_N = 1                       # of the driver's force, where the device tells no newtons
//   offset_m = [0, 0.01, 0]
//   gravity_N = [0, 0, 0.6]
//   neutral_turn = [0, 0, 0.01]
//   neutral_push = [0, 0.02, 0]
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "master_station/devices/model/calibration.h"
#include "master_station/devices/model/device_model.h"

namespace farfeel::devices {

struct DeviceFile {
  DeviceModel model;  ///< with the file's figures in place of the built-in ones
  Calibration calibration;
};

/// Beyond these a calibration went wrong.
inline constexpr double kMostOffset_m = 1, kMostGravity_N = 3, kMostNeutral = 0.3;
inline constexpr double kLeastUnitsPerN = 0.001, kMostUnitsPerN = 1000;
inline constexpr std::size_t kDeviceFileBytesMax = 65536;

/// $XDG_CONFIG_HOME/farfeel/devices, or ~/.config/farfeel/devices; an error where neither variable is set.
[[nodiscard]] tl::expected<std::string, ModelError> device_folder();
/// "<model>-<serial>.toml". A serial number is a stranger's bytes: what is no letter, digit, '-' or '_' is written as
/// %XX, and one beyond 64 bytes is cut and told apart by a hash.
[[nodiscard]] std::string device_file_name(std::string_view model, std::string_view serial);

[[nodiscard]] tl::expected<DeviceFile, ModelError> parse_device_file(std::string_view toml, std::string_view file,
                                                                     const DeviceModel& model);
/// What of `device` differs from `model`, as parse_device_file reads it.
[[nodiscard]] std::string device_file_text(const DeviceFile& device, const DeviceModel& model);

/// The model as it is where there is no file.
[[nodiscard]] tl::expected<DeviceFile, ModelError> read_device_file(const std::string& path, const DeviceModel& model);
/// Makes the folder if it is not there. Refuses what read_device_file would refuse. Whoever reads sees all of the old
/// or all of the new.
[[nodiscard]] tl::expected<void, ModelError> write_device_file(const std::string& path, const DeviceFile& device,
                                                               const DeviceModel& model);

}  // namespace farfeel::devices
