#include "codecs/settings/program_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <utility>

namespace farfeel::codecs {
namespace {

bool is_number(const std::string& type) {
  return type.starts_with("FLOAT") || type.starts_with("INT") || type.starts_with("UINT");
}

/// "m/s" of "Of a rate input: the tool's speed [m/s]", and the help without it.
std::pair<std::string, std::string> unit_and_help(const std::string& help, const std::string& type) {
  static const std::regex kUnit(R"( \[([^\]]+)\])");
  std::smatch found;
  if (!is_number(type) || !std::regex_search(help, found, kUnit)) return {"", help};
  return {found[1], found.prefix().str() + found.suffix().str()};
}

/// In words, from "FLOAT:FLOAT in [0.1 - 200]", "TEXT:{soft,medium,hard}", "UINT", "TEXT:FILE".
std::string limits_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  if (option.get_expected_max() == 0) return "true or false";
  static const std::regex kRange(R"(in \[(.+) - (.+)\])"), kWords(R"(\{(.+)\})"), kComma(",");
  std::smatch found;
  if (std::regex_search(type, found, kRange)) return fmt::format("{} to {}", found[1].str(), found[2].str());
  if (std::regex_search(type, found, kWords)) return std::regex_replace(found[1].str(), kComma, ", ");
  if (type.ends_with(":FILE")) return "a file";
  if (type.ends_with(":DIR")) return "a folder";
  return type.starts_with("UINT") || type.ends_with("NONNEGATIVE") ? "0 or more" : "";
}

void add_options(CLI::App& app, const std::string& command, std::vector<ProgramOption>& all) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_lnames().empty() || option == app.get_help_ptr()) continue;
    const std::string& name = option->get_lnames().front();
    const auto [unit, help] = unit_and_help(option->get_description(), option->get_type_name());
    all.push_back({command, "--" + name, option->get_configurable() ? key_of(name) : "", unit,
                   option->get_default_str(), limits_of(*option), help, option, &app});
  }
  for (CLI::App* each : app.get_subcommands([](CLI::App*) { return true; }))
    add_options(*each, command.empty() ? each->get_name() : command + " " + each->get_name(), all);
}

const Setting* setting_of(const ProgramOption& known, const Settings& settings) {
  const auto found = known.key.empty() ? settings.end() : settings.find(known.key);
  return found == settings.end() ? nullptr : &found->second;
}

bool is_asked_for(const CLI::App* app) {
  return app->get_parent() == nullptr || app->parsed();
}

bool is_excluded(const CLI::Option& option) {
  const std::set<CLI::Option*> others = option.get_excludes();
  return std::any_of(others.begin(), others.end(), [](const CLI::Option* other) { return other->count() > 0; });
}

}  // namespace

std::vector<ProgramOption> options_of(CLI::App& app) {
  std::vector<ProgramOption> all;
  add_options(app, "", all);
  return all;
}

std::vector<std::string> keys_of(const std::vector<ProgramOption>& options) {
  std::vector<std::string> keys;
  for (const ProgramOption& known : options)
    if (!known.key.empty()) keys.push_back(known.key);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

void count_as_given(const std::vector<ProgramOption>& options, const Settings& settings) {
  for (const ProgramOption& set : options) {
    if (setting_of(set, settings) == nullptr) continue;
    set.option->required(false);
    for (const ProgramOption& other : options) other.option->remove_needs(set.option);
  }
}

std::string take(const ProgramOption& known, const Setting& setting) {
  try {
    known.option->run_callback_for_default()->default_val(setting.value);
  } catch (const CLI::ParseError& error) {
    return fmt::format("{}: {}", setting.origin, error.what());
  }
  return {};
}

std::string take_settings(const std::vector<ProgramOption>& options, const Settings& settings) {
  for (const ProgramOption& known : options) {
    const Setting* const setting = setting_of(known, settings);
    if (setting == nullptr || !is_asked_for(known.owner) || known.option->count() > 0 || is_excluded(*known.option))
      continue;
    if (std::string wrong = take(known, *setting); !wrong.empty()) return wrong;
  }
  return {};
}

std::string options_as_json(const std::string& program, const std::string& about,
                            const std::vector<ProgramOption>& options, const Settings& settings) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const ProgramOption& known : options) {
    const Setting* const setting = setting_of(known, settings);
    all.push_back({{"command", known.command},
                   {"name", known.name},
                   {"key", known.key},
                   {"unit", known.unit},
                   {"default", known.fallback},
                   {"limits", known.limits},
                   {"help", known.help},
                   {"value", setting == nullptr ? known.fallback : setting->value},
                   {"origin", setting == nullptr ? "default" : setting->origin}});
  }
  return nlohmann::ordered_json{{"program", program}, {"about", about}, {"options", all}}.dump();
}

}  // namespace farfeel::codecs
