#include "master_station/devices/model/device_file.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "master_station/devices/model/figures.h"
#include "master_station/devices/model/model_table.h"
#include "transport/keys/checked_file.h"

namespace farfeel::devices {
namespace {

using codecs::CheckedTable;

constexpr std::array<std::string_view, 6> kCalibrationKeys{"axes",      "units_per_N",  "offset_m",
                                                           "gravity_N", "neutral_turn", "neutral_push"};
constexpr std::size_t kMostSerialBytes = 64;
constexpr std::array<std::string_view, 6> kAxes{"+x", "+y", "+z", "-x", "-y", "-z"};

/// Each component within +-most, or all of them if it is a length.
glm::dvec3 bounded(const CheckedTable& table, std::string_view key, double most, std::string_view unit) {
  const glm::dvec3 v = table.vector(key, glm::dvec3(0), 1e6);
  if (glm::length(v) > most)
    table.fail(key, fmt::format("is {:.3g} {} long; more than {:g} {} is no calibration of a device, do it again",
                                glm::length(v), unit, most, unit));
  return v;
}

glm::dmat3 read_axes(const CheckedTable& table) {
  const std::vector<std::string> axes = table.texts("axes", {"+x", "+y", "+z"});
  glm::dmat3 R_AB(0);
  for (std::size_t i = 0; i < 3 && axes.size() == 3; ++i) {
    for (std::size_t a = 0; a < kAxes.size(); ++a) {
      if (axes[i] == kAxes[a]) R_AB[static_cast<int>(i)][static_cast<int>(a % 3)] = a < 3 ? 1 : -1;
    }
  }
  if (std::abs(glm::determinant(R_AB) - 1) > 1e-9)
    table.fail("axes", "must name x, y and z once each, with sign, right-handed, like [\"+x\", \"-z\", \"+y\"]");
  return glm::transpose(R_AB);
}

Calibration read_calibration(const CheckedTable& table) {
  Calibration calibration;
  calibration.R_BA = read_axes(table);
  calibration.offset_B_m = bounded(table, "offset_m", kMostOffset_m, "m");
  calibration.units_per_N = table.number("units_per_N", calibration.units_per_N, kLeastUnitsPerN, kMostUnitsPerN);
  calibration.gravity_B_N = bounded(table, "gravity_N", kMostGravity_N, "N");
  calibration.neutral.turn = bounded(table, "neutral_turn", kMostNeutral, "of full travel");
  calibration.neutral.push = bounded(table, "neutral_push", kMostNeutral, "of full travel");
  return calibration;
}

std::string vector_text(const glm::dvec3& v) {
  return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}

std::string calibration_text(const Calibration& calibration) {
  std::string axes;
  const glm::dmat3 R_AB = glm::transpose(calibration.R_BA);
  for (int i = 0; i < 3; ++i) {
    for (std::size_t a = 0; a < kAxes.size(); ++a) {
      if (R_AB[i][static_cast<int>(a % 3)] == (a < 3 ? 1 : -1))
        axes += fmt::format("{}\"{}\"", axes.empty() ? "" : ", ", kAxes[a]);
    }
  }
  return fmt::format(
      "\n[calibration]\naxes = [{}]\nunits_per_N = {}\noffset_m = {}\ngravity_N = {}\nneutral_turn = {}\nneutral_push "
      "= {}\n",
      axes, calibration.units_per_N, vector_text(calibration.offset_B_m), vector_text(calibration.gravity_B_N),
      vector_text(calibration.neutral.turn), vector_text(calibration.neutral.push));
}

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

}  // namespace

tl::expected<std::string, ModelError> device_folder() {
  if (const char* config = std::getenv("XDG_CONFIG_HOME"); config != nullptr && *config != '\0')
    return std::string(config) + "/farfeel/devices";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return std::string(home) + "/.config/farfeel/devices";
  return tl::unexpected(ModelError{"neither XDG_CONFIG_HOME nor HOME is set, so there is no place for calibrations"});
}

std::string device_file_name(std::string_view model, std::string_view serial) {
  const auto plain = [](std::string_view text) {
    std::string name;
    for (const char c : text.substr(0, kMostSerialBytes)) {
      const bool is_plain =
          (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
      name += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return text.size() > kMostSerialBytes ? fmt::format("{}%{:016X}", name, fnv1a(text)) : name;
  };
  return fmt::format("{}-{}.toml", plain(model), plain(serial));
}

tl::expected<DeviceFile, ModelError> parse_device_file(std::string_view toml, std::string_view file,
                                                       const DeviceModel& model) {
  if (toml.size() > kDeviceFileBytesMax)
    return tl::unexpected(ModelError{fmt::format("{} is longer than {} bytes", file, kDeviceFileBytesMax)});
  try {
    toml::table root = toml::parse(toml, file);
    DeviceFile device;
    {
      std::vector<std::string_view> keys = model_keys();
      keys.push_back("calibration");
      const CheckedTable top(root, "", file, keys);
      if (const auto table = top.table("calibration", kCalibrationKeys)) device.calibration = read_calibration(*table);
    }
    root.erase("calibration");
    device.model = read_model(CheckedTable(root, "", file, model_keys()), model);
    return device;
  } catch (const toml::parse_error& error) {
    return tl::unexpected(
        ModelError{fmt::format("{}:{}: not TOML: {}", file, error.source().begin.line, error.description())});
  } catch (const codecs::TableFault& fault) {
    return tl::unexpected(ModelError{fault.message});
  }
}

std::string device_file_text(const DeviceFile& device, const DeviceModel& model) {
  std::string text = fmt::format("# {}: what this one differs in. Written by 'farfeel device'.\n", model.title);
  for (const Figure& figure : kFigures) {
    if (device.model.*figure.member != model.*figure.member)
      text += fmt::format("{} = {}\n", figure.key, device.model.*figure.member);
  }
  if (device.model.workspace_min_B_m != model.workspace_min_B_m)
    text += fmt::format("workspace_min_B_m = {}\n", vector_text(device.model.workspace_min_B_m));
  if (device.model.workspace_max_B_m != model.workspace_max_B_m)
    text += fmt::format("workspace_max_B_m = {}\n", vector_text(device.model.workspace_max_B_m));
  if (device.model.estimated != model.estimated) {
    std::string names;
    for (const std::string& name : device.model.estimated)
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", name);
    text += fmt::format("estimated = [{}]\n", names);
  }
  return text + (device.calibration == Calibration{} ? "" : calibration_text(device.calibration));
}

tl::expected<DeviceFile, ModelError> read_device_file(const std::string& path, const DeviceModel& model) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) return DeviceFile{model, {}};
  if (!std::filesystem::is_regular_file(status))
    return tl::unexpected(ModelError{fmt::format("can't read {}: it is no plain file", path)});
  std::ifstream in(path, std::ios::binary);
  std::string text(kDeviceFileBytesMax + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad() || (in.fail() && !in.eof()))
    return tl::unexpected(ModelError{fmt::format("can't read {}: may this user read it?", path)});
  text.resize(static_cast<std::size_t>(in.gcount()));
  return parse_device_file(text, path, model);
}

tl::expected<void, ModelError> write_device_file(const std::string& path, const DeviceFile& device,
                                                 const DeviceModel& model) {
  const std::string text = device_file_text(device, model);
  if (const auto readable = parse_device_file(text, path, model); !readable) return tl::unexpected(readable.error());
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  if (error) return tl::unexpected(ModelError{fmt::format("can't make the folder of {}: {}", path, error.message())});
  if (const auto written = transport::write_private_file(path, text); !written)
    return tl::unexpected(ModelError{written.error().message});
  return {};
}

}  // namespace farfeel::devices
