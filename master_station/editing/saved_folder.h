// A scene that was saved, as a folder: from a node's bytes, which are believed in nothing.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/scene/saved_scene.h"

namespace farfeel::master_station {

/// What is in the way of writing there, with what to do; empty where nothing is: the folder is not there, or empty.
[[nodiscard]] std::string in_the_way_of(const std::filesystem::path& folder);

/// How many objects the scene has; 0 where its TOML is none, or names any file but those that are here.
[[nodiscard]] std::size_t objects_within(const std::vector<codecs::SavedFile>&);

struct SavedFolder {
  std::size_t objects = 0, bytes = 0;
};
/// Writes an object of codecs/scene/saved_scene.h as a folder, which is there whole or not at all. Fails where the
/// bytes are no such object, or their scene names any file but those that came with it.
[[nodiscard]] tl::expected<SavedFolder, std::string> write_saved_folder(std::span<const std::byte> object,
                                                                        const std::filesystem::path& folder);

}  // namespace farfeel::master_station
