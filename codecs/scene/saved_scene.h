// A scene as the files that a node starts from, in one object: scene.toml first, then the assets that it names.
//
// PROTOCOL.md has the table. Names are such that they can only mean files in one folder.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace farfeel::codecs {

/// Points into the object's bytes.
struct SavedFile {
  std::string name;
  std::span<const std::byte> bytes;
};

inline constexpr const char* kSavedSceneFile = "scene.toml";
inline constexpr const char* kSavedAssetEnding = ".glb";
inline constexpr std::size_t kMostSavedFiles = 258;      ///< the scene's, the tool's and 256 objects'
inline constexpr std::size_t kMostSavedText = 1u << 20;  ///< bytes of scene.toml

/// The first file is scene.toml, the others are assets under plain names (plain_names.h) that end in .glb.
[[nodiscard]] std::vector<std::byte> write_saved_scene(std::span<const SavedFile>);
/// Of anybody's bytes. Nothing where they are no such object, where a name could mean anything else than a file of its
/// own in the folder, or where scene.toml is too long.
[[nodiscard]] std::optional<std::vector<SavedFile>> read_saved_scene(std::span<const std::byte>);

}  // namespace farfeel::codecs
