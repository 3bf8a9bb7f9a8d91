#include "codecs/mesh/gltf_uri.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <system_error>

namespace farfeel::codecs {
namespace {

std::optional<std::string> decoded(std::string_view uri) {
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%') {
      out += uri[i];
      continue;
    }
    unsigned value = 0;
    const std::string_view digits = uri.substr(i + 1, 2);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (digits.size() != 2 || error != std::errc() || end != digits.data() + 2) return std::nullopt;
    out += static_cast<char>(value);
    i += 2;
  }
  return out;
}

/// RFC 3986: a letter, then letters, digits, '+', '-' and '.', up to a colon.
bool has_scheme(std::string_view uri) {
  const std::string_view head = uri.substr(0, uri.find(':'));
  return head.size() < uri.size() && head.find_first_of("/%") == std::string_view::npos && !head.empty();
}

}  // namespace

tl::expected<std::filesystem::path, std::string> file_within(std::string_view uri) {
  const auto wrong = [&](const char* why) {
    return tl::unexpected(
        fmt::format("its buffer '{}' {}; put the file into the folder of the document and name it from there",
                    uri.substr(0, 60), why));
  };
  if (has_scheme(uri)) return wrong("is not a file beside it, but somewhere else");
  const auto name = decoded(uri);
  if (!name) return wrong("has a %-code that is none");
  if (name->find('\0') != std::string::npos || name->find('\\') != std::string::npos)
    return wrong("has a character that no file's name has");
  const std::filesystem::path path = std::filesystem::path(*name).lexically_normal();
  if (path.is_absolute() || (!path.empty() && *path.begin() == "..")) return wrong("is not a file beside it");
  if (!path.has_filename() || path == ".") return wrong("names no file");
  return path;
}

bool is_file_within(const std::filesystem::path& folder, const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path root = fs::canonical(folder, error);
  if (error) return false;
  const fs::path file = fs::canonical(folder / path, error);
  if (error || !fs::is_regular_file(file, error)) return false;
  const fs::path way = file.lexically_relative(root);
  return !way.empty() && *way.begin() != "..";
}

}  // namespace farfeel::codecs
