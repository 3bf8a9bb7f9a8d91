#include "codecs/settings/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/settings/version.h"
#include "codecs/text/nearest_word.h"

namespace farfeel::codecs {
namespace {

// The library takes "nan" for a number within any limits, and -1 for the largest one without a sign.
void hold_to_sane_numbers(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    if (type.starts_with("FLOAT")) {
      option->check([](const std::string& text) {
        return std::isfinite(std::strtod(text.c_str(), nullptr)) ? std::string() : text + " is not a finite number";
      });
    } else if (type.starts_with("UINT")) {
      option->check([](const std::string& text) {
        return text.find('-') == std::string::npos ? std::string() : text + " is negative: it has to be 0 or more";
      });
    }
  }
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) hold_to_sane_numbers(*command);
}

/// What could stand where `word` does: the options of the commands that were named, or commands.
std::vector<std::string> known_words(const CLI::App& app, bool is_option) {
  std::vector<std::string> words;
  if (is_option) {
    for (const CLI::Option* option : app.get_options())
      for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
  } else if (app.get_subcommands().empty()) {
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
      words.push_back(command->get_name());
  }
  for (const CLI::App* command : app.get_subcommands()) {
    for (std::string& word : known_words(*command, is_option)) words.push_back(std::move(word));
  }
  return words;
}

std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> strange = app.remaining(true);
  if (strange.empty()) return error.what();
  const std::string word = strange.front().substr(0, strange.front().find('='));
  const bool is_option = word.starts_with('-');
  const std::vector<std::string> known = known_words(app, is_option);
  if (!is_option && known.empty()) return fmt::format("\"{}\" was not expected", word);
  const std::string_view meant = nearest_word(word, std::vector<std::string_view>(known.begin(), known.end()));
  return fmt::format("there is no {} \"{}\"{}", is_option ? "option" : "command", word,
                     meant.empty() ? "" : fmt::format("; did you mean \"{}\"?", meant));
}

}  // namespace

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv) {
  app.set_version_flag("--version", version_text(app.get_name()), "Print version, build, kernel and instruction set");
  hold_to_sane_numbers(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    fmt::print(stderr, "{}: {}\n{} --help lists what it takes.\n", app.get_name(), complaint(app, error),
               app.get_name());
    return kUsageError;
  }
  return std::nullopt;
}

}  // namespace farfeel::codecs
