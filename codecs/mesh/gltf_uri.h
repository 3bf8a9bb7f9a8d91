// Names of files in glTF documents.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace farfeel::codecs {

/// The file that a URI names, within the document's folder: relative, %-codes read, "." and what "a/.." takes back left
/// out. Refused: a scheme, an absolute path, what leads out of the folder, codes that are none, a zero byte.
[[nodiscard]] tl::expected<std::filesystem::path, std::string> file_within(std::string_view uri);

/// Whether the path, below the folder and all links followed, is a file in that folder or below it.
[[nodiscard]] bool is_file_within(const std::filesystem::path& folder, const std::filesystem::path& path);

}  // namespace farfeel::codecs
