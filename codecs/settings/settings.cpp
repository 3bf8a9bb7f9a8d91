#include "codecs/settings/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <optional>

#include "codecs/text/nearest_word.h"
#include "codecs/text/toml.h"

namespace farfeel::codecs {
namespace {

std::string environment(const std::string& name) {
  const char* const value = std::getenv(name.c_str());
  return value == nullptr ? "" : value;
}

/// As it would stand on the command line; nothing of what is no single value.
std::optional<std::string> value_of(const toml::node& node) {
  if (const auto text = node.value_exact<std::string>()) return *text;
  if (const auto flag = node.value_exact<bool>()) return *flag ? "true" : "false";
  if (const auto whole = node.value_exact<std::int64_t>()) return fmt::format("{}", *whole);
  if (const auto number = node.value_exact<double>()) return fmt::format("{}", *number);
  return std::nullopt;
}

[[noreturn]] void refuse(const std::string& path, const toml::source_region& where, const std::string& what) {
  throw TableFault{fmt::format("{}:{}: {}", path, where.begin.line, what)};
}

void add_file(const std::string& path, const std::string& text, std::span<const std::string> keys, Settings& settings) {
  const toml::table table = toml::parse(text, path);
  for (const auto& [written, node] : table) {
    const std::string key = key_of(written.str());
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      const std::string_view meant = nearest_word(key, std::vector<std::string_view>(keys.begin(), keys.end()));
      refuse(path, written.source(),
             fmt::format("there is no option \"{}\"{}", written.str(),
                         meant.empty() ? "" : fmt::format("; did you mean \"{}\"?", meant)));
    }
    const auto value = value_of(node);
    if (!value) refuse(path, node.source(), fmt::format("{} has to be a number, a \"text\", true or false", key));
    settings.emplace(key, Setting{*value, fmt::format("{}:{}", path, written.source().begin.line)});
  }
}

}  // namespace

std::vector<std::string> settings_folders() {
  std::vector<std::string> folders = {"/etc/farfeel"};
  if (const std::string config = environment("XDG_CONFIG_HOME"); !config.empty())
    folders.insert(folders.begin(), config + "/farfeel");
  else if (const std::string home = environment("HOME"); !home.empty())
    folders.insert(folders.begin(), home + "/.config/farfeel");
  return folders;
}

SettingPlaces places_of(std::string_view program) {
  SettingPlaces places;
  for (const std::string& folder : settings_folders())
    places.files.push_back(fmt::format("{}/{}.toml", folder, program));
  return places;
}

std::string key_of(std::string_view option) {
  std::string key(option);
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

std::string variable_of(std::string_view key) {
  std::string name = "FARFEEL_";
  for (const char c : key) name += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

tl::expected<Settings, std::string> read_settings(const SettingPlaces& places, std::span<const std::string> keys) {
  Settings settings;
  for (const std::string& key : keys) {
    const std::string name = variable_of(key);
    const std::string value = places.has_environment ? environment(name) : std::string();
    if (!value.empty()) settings.emplace(key, Setting{value, name});
  }
  for (const std::string& path : places.files) {
    const auto text = read_trusted_file(path, places.reader);
    if (!text) return tl::unexpected(text.error());
    if (!*text) continue;
    try {
      add_file(path, **text, keys, settings);
    } catch (const toml::parse_error& error) {
      return tl::unexpected(fmt::format("{}:{}: not TOML: {}", path, error.source().begin.line, error.description()));
    } catch (const TableFault& fault) {
      return tl::unexpected(fault.message);
    }
  }
  return settings;
}

}  // namespace farfeel::codecs
