// Names from anywhere, made fit for file systems, and text made fit for TOML.
#pragma once

#include <set>
#include <string>
#include <string_view>

namespace farfeel::codecs {

inline constexpr std::size_t kMostPlainName = 60;

/// Of letters, digits, '-', '_' and '.' alone, no '.' first, at most kMostPlainName bytes: no file system and no shell
/// minds it. `fallback` where nothing is left.
[[nodiscard]] std::string plain_name(std::string_view name, std::string_view fallback);
[[nodiscard]] bool is_plain_name(std::string_view name);
/// As it is, or with a number behind it where it is taken; it is taken then.
[[nodiscard]] std::string unlike(const std::string& name, std::set<std::string>& taken);
/// Between quotes, as TOML has it; bytes that are no UTF-8 are replaced.
[[nodiscard]] std::string quoted_for_toml(std::string text);

}  // namespace farfeel::codecs
