// The parts of an assembly as files: what their assets are called, and the scene that they make together.
#pragma once

#include <string>
#include <vector>

#include "codecs/mesh/mesh_parts.h"

namespace farfeel::slave_sim {

/// A name for each shape's asset, after the first part that has it: letters, digits, '-', '_' and '.', none twice, each
/// ending in ".glb".
[[nodiscard]] std::vector<std::string> asset_names(const codecs::MeshParts&);

/// A scene.toml beside these assets, under a round probe: every part in its place, under its own name as far as no
/// other has it.
[[nodiscard]] std::string scene_of_parts(const codecs::MeshParts&, const std::vector<std::string>& asset_names,
                                         const std::string& title, double metres_per_unit);

}  // namespace farfeel::slave_sim
