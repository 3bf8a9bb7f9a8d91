#include "codecs/text/plain_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

namespace farfeel::codecs {
namespace {

bool is_plain(unsigned char c) {
  return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.';
}

}  // namespace

std::string plain_name(std::string_view name, std::string_view fallback) {
  std::string out(name.substr(0, kMostPlainName));
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return !is_plain(c); }, '_');
  const std::size_t first = out.find_first_not_of('.');
  return first == std::string::npos ? std::string(fallback) : out.substr(first);
}

bool is_plain_name(std::string_view name) {
  return !name.empty() && name.size() <= kMostPlainName && name.front() != '.' && std::ranges::all_of(name, is_plain);
}

std::string unlike(const std::string& name, std::set<std::string>& taken) {
  std::string other = name;
  for (int n = 2; !taken.insert(other).second; ++n) other = fmt::format("{}-{}", name, n);
  return other;
}

/// TOML's strings are JSON's but for one character.
std::string quoted_for_toml(std::string text) {
  constexpr char kDelete = 0x7F;
  std::erase(text, kDelete);
  return nlohmann::json(std::move(text)).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace farfeel::codecs
