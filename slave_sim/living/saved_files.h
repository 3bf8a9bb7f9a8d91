// The scene as it is now, as the files that a node starts from: scene.toml, and an asset for each object and the tool.
//
// What is felt is all there, dents among it, and every object stands where it is, or where it is going. What is drawn
// is as it was made: a dent is felt, and not drawn. Of the timeline nothing is left.
#pragma once

#include <cstddef>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "slave_sim/world/world.h"

namespace farfeel::slave_sim {

/// One object of the bulk lane (codecs/scene/saved_scene.h). Reads no files; takes as long as Draco takes for all
/// visible meshes. Fails, with figures, where it would be larger than such an object may be.
[[nodiscard]] tl::expected<std::vector<std::byte>, std::string> saved_files(const World& now);

/// scene.toml of these, which has the objects' assets under the names given, and the tool's under the last.
[[nodiscard]] std::string scene_text(const World& now, const std::vector<std::string>& asset_names);

}  // namespace farfeel::slave_sim
