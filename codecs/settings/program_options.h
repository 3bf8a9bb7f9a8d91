// What is known of a program's options, from their registration alone: there is no second list of them. They are set by
// the command line and by settings.h, shown by `farfeel config show`, and told in docs/options.md.
#pragma once

#include <string>
#include <vector>

#include "codecs/settings/settings.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace farfeel::codecs {

struct ProgramOption {
  std::string command;  ///< of the program's commands whose option it is, "serve"; empty: the program's own
  std::string name;     ///< "--max-force"
  std::string key;      ///< "max_force"; empty where the command line alone may set it (CLI11: not configurable)
  std::string unit;     ///< "N", from the help's "[N]"
  std::string fallback;
  std::string limits;  ///< "0.1 to 200", "soft, medium, hard"
  std::string help;
  CLI::Option* option;
  const CLI::App* owner;
};

/// Those with a long name, with the commands' after the program's own.
[[nodiscard]] std::vector<ProgramOption> options_of(CLI::App&);
/// Each key once.
[[nodiscard]] std::vector<std::string> keys_of(const std::vector<ProgramOption>&);

/// Before the command line is parsed: an option that is set elsewhere counts as given, for whatever needs it.
void count_as_given(const std::vector<ProgramOption>&, const Settings&);
/// Takes a setting for an option, within its limits. Returns what is wrong with it; empty where nothing is.
[[nodiscard]] std::string take(const ProgramOption&, const Setting&);
/// After the command line was parsed: takes what is set elsewhere for each option that may be given in what was asked
/// for and was not, unless one that excludes it was. Returns what is wrong; empty where nothing is.
[[nodiscard]] std::string take_settings(const std::vector<ProgramOption>&, const Settings&);

/// One JSON object of all that is known, with value and origin.
[[nodiscard]] std::string options_as_json(const std::string& program, const std::string& about,
                                          const std::vector<ProgramOption>&, const Settings&);

}  // namespace farfeel::codecs
