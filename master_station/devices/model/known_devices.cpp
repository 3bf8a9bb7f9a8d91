#include "master_station/devices/model/known_devices.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "transport/keys/checked_file.h"

namespace farfeel::devices {
namespace {

std::string path_of(const std::string& folder, std::string_view serial, const DeviceFile& device) {
  return folder + "/" + device_file_name(device.model.name, serial);
}

/// All that decides how it pushes: every figure, and the calibration.
std::string fingerprint(const DeviceFile& device) {
  return device_file_text(device, DeviceModel{});
}

}  // namespace

tl::expected<std::string, ModelError> known_devices_folder() {
  if (const char* state = std::getenv("XDG_STATE_HOME"); state != nullptr && *state != '\0')
    return std::string(state) + "/farfeel/devices";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return std::string(home) + "/.local/state/farfeel/devices";
  return tl::unexpected(ModelError{"neither XDG_STATE_HOME nor HOME is set: every device counts as new"});
}

bool is_known_device(const std::string& folder, std::string_view serial, const DeviceFile& device) {
  std::ifstream in(path_of(folder, serial, device), std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return in && text == fingerprint(device);
}

tl::expected<void, ModelError> remember_device(const std::string& folder, std::string_view serial,
                                               const DeviceFile& device) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const auto written = transport::write_private_file(path_of(folder, serial, device), fingerprint(device));
  if (!written) return tl::unexpected(ModelError{written.error().message});
  return {};
}

}  // namespace farfeel::devices
