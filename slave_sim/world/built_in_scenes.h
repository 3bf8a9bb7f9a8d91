// The scene files of slave_sim/world/scenes/, carried in the program. The array is written by CMake.
#pragma once

#include <span>
#include <string_view>

namespace farfeel::slave_sim {

struct BuiltInScene {
  std::string_view name;  ///< the file's name without .toml
  std::string_view toml;
};

extern const std::span<const BuiltInScene> kBuiltInScenes;

}  // namespace farfeel::slave_sim
