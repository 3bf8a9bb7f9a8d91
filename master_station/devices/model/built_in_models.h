// The data of devices that this program carries: the *.toml files of this folder, put in by CMake.
#pragma once

#include <span>
#include <string_view>

namespace farfeel::devices {

struct BuiltInModel {
  std::string_view name, toml;
};

extern const std::span<const BuiltInModel> kBuiltInModels;

}  // namespace farfeel::devices
