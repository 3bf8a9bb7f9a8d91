// What is set for a program other than on its command line. Of two that set the same the first counts: the environment
// (FARFEEL_RATE), the user's file (~/.config/farfeel/master.toml), the system's (/etc/farfeel/master.toml). A file is
// one program's, and a list of its options: rate = 2000.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "codecs/settings/trusted_file.h"

namespace farfeel::codecs {

struct Setting {
  std::string value;   ///< as it would stand on the command line
  std::string origin;  ///< "FARFEEL_RATE", or "/etc/farfeel/master.toml:3"
};

/// By key: the option's name as TOML writes it, "max_force" of --max-force.
using Settings = std::map<std::string, Setting, std::less<>>;

struct SettingPlaces {
  bool has_environment = true;
  std::vector<std::string> files;  ///< the first has precedence
  FileReader reader = this_reader();
};

/// $XDG_CONFIG_HOME/farfeel or ~/.config/farfeel, and /etc/farfeel; the first is missing where there is no HOME.
[[nodiscard]] std::vector<std::string> settings_folders();
/// "master.toml" in each of them, and the environment.
[[nodiscard]] SettingPlaces places_of(std::string_view program);

[[nodiscard]] std::string key_of(std::string_view option);    ///< "max_force" of "max-force"
[[nodiscard]] std::string variable_of(std::string_view key);  ///< "FARFEEL_MAX_FORCE" of "max_force"

/// Of a program that knows `keys`. A file may write "max-force" for max_force. The error says file, line and what is
/// wrong: a key that is not known with the nearest one.
[[nodiscard]] tl::expected<Settings, std::string> read_settings(const SettingPlaces&,
                                                                std::span<const std::string> keys);

}  // namespace farfeel::codecs
