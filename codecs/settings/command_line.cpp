#include "codecs/settings/command_line.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "codecs/settings/program_options.h"
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

/// A value that is none of those listed, with the nearest: the library says "--rung: tils not in {auto,tiles}".
std::string with_nearest(const std::string& words) {
  constexpr std::string_view kNone = " not in {";
  const std::size_t colon = words.find(": "), none = words.find(kNone);
  if (colon == std::string::npos || none == std::string::npos || none < colon || !words.ends_with('}')) return words;
  const std::size_t begin = none + kNone.size();
  const std::vector<std::string> listed = CLI::detail::split(words.substr(begin, words.size() - 1 - begin), ',');
  const std::string word = words.substr(colon + 2, none - colon - 2);
  const std::string_view meant = nearest_word(word, std::vector<std::string_view>(listed.begin(), listed.end()));
  return fmt::format("{}: there is no \"{}\"{} There are {}", words.substr(0, colon), word,
                     meant.empty() ? "." : fmt::format("; did you mean \"{}\"?", meant), fmt::join(listed, ", "));
}

std::string complaint(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> strange = app.remaining(true);
  if (strange.empty()) return with_nearest(error.what());
  const std::string word = strange.front().substr(0, strange.front().find('='));
  const bool is_option = word.starts_with('-');
  const std::vector<std::string> known = known_words(app, is_option);
  if (!is_option && known.empty()) return fmt::format("\"{}\" was not expected", word);
  const std::string_view meant = nearest_word(word, std::vector<std::string_view>(known.begin(), known.end()));
  return fmt::format("there is no {} \"{}\"{}", is_option ? "option" : "command", word,
                     meant.empty() ? "" : fmt::format("; did you mean \"{}\"?", meant));
}

/// "master" of "farfeel-master" and of "farfeel master"; empty for what takes its command line alone, such as
/// measurements ("farfeel-bench", "farfeel-bench count") or a test.
std::string program_of(const std::string& name) {
  constexpr std::string_view kHouse = "farfeel";
  if (!name.starts_with(kHouse) || name.size() < kHouse.size() + 2) return {};
  const std::string program = name.substr(kHouse.size() + 1);
  return program == "bench" || program.find(' ') == std::string::npos ? program : std::string();
}

int complain(const CLI::App& app, const std::string& what) {
  fmt::print(stderr, "{}: {}\n", app.get_name(), what);
  return kUsageError;
}

/// Every setting is looked at, also those of other commands of the program.
std::string wrong_among(const std::vector<ProgramOption>& options, const Settings& settings) {
  for (const ProgramOption& known : options) {
    const auto setting = settings.find(known.key);
    if (setting == settings.end()) continue;
    if (std::string wrong = take(known, setting->second); !wrong.empty()) return wrong;
  }
  return {};
}

/// Where this program is to look, by its command line and FARFEEL_NO_SETTINGS.
SettingPlaces wished_places(const std::string& program, const std::vector<std::string>& arguments) {
  const bool has_none = std::getenv("FARFEEL_NO_SETTINGS") != nullptr ||
                        std::find(arguments.begin(), arguments.end(), "--no-settings") != arguments.end();
  return has_none ? SettingPlaces{.has_environment = false, .files = {}} : places_of(program);
}

/// What `farfeel config` asks of each program; nothing where it asks nothing.
std::optional<int> answer_config(CLI::App& app, const std::string& program, const std::vector<ProgramOption>& options,
                                 const std::vector<std::string>& arguments) {
  if (arguments.empty() || (arguments[0] != kDescribeOptions && arguments[0] != kCheckSettings)) return std::nullopt;
  SettingPlaces places = wished_places(program, arguments);
  if (arguments[0] == kCheckSettings)
    places = {.has_environment = false, .files = {arguments.begin() + 1, arguments.end()}};
  const auto settings = read_settings(places, keys_of(options));
  if (!settings) return complain(app, settings.error());
  if (const std::string wrong = wrong_among(options, *settings); !wrong.empty()) return complain(app, wrong);
  if (arguments[0] == kDescribeOptions)
    fmt::print("{}\n", options_as_json(program, app.get_description(), options, *settings));
  return 0;
}

/// An allocation that nobody takes care of ends the program with words, which are made while there is memory.
void tell_when_memory_ends(const std::string& name) {
  static std::string words;
  rlimit space{};
  const bool is_limited = ::getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY;
  words = fmt::format(
      "{}: out of memory{}\n", name,
      is_limited ? fmt::format("; its address space is limited to {} MB (ulimit -v)", space.rlim_cur >> 20) : "");
  static const std::terminate_handler otherwise = std::get_terminate();
  std::set_terminate([] {
    try {
      if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
    } catch (const std::bad_alloc&) {
      if (::write(STDERR_FILENO, words.data(), words.size()) >= 0) std::_Exit(1);
    } catch (...) {
    }
    otherwise();
  });
}

std::optional<int> parse(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& ended) {  // by a command that ran as it was read
    return ended.get_exit_code();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    fmt::print(stderr, "{}: {}\n{} --help lists what it takes.\n", app.get_name(), complaint(app, error),
               app.get_name());
    return kUsageError;
  }
  return std::nullopt;
}

}  // namespace

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv) {
  tell_when_memory_ends(app.get_name());
  hold_to_sane_numbers(app);
  const std::string program = program_of(app.get_name());
  const std::vector<ProgramOption> options = options_of(app);
  app.set_version_flag("--version", version_text(app.get_name()), "Print version, build, kernel and instruction set");
  if (program.empty()) return parse(app, argc, argv);
  const std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
  if (const auto answered = answer_config(app, program, options, arguments)) return answered;

  app.add_flag("--no-settings")->description("Take nothing from files of settings and FARFEEL_ variables");
  app.footer(fmt::format("{}{}What is set elsewhere: farfeel config show {} --origin", app.get_footer(),
                         app.get_footer().empty() ? "" : "\n\n", program));
  const auto settings = read_settings(wished_places(program, arguments), keys_of(options));
  if (settings) count_as_given(options, *settings);
  if (const auto done = parse(app, argc, argv)) return done;  // --help helps, whatever the files say
  if (!settings) return complain(app, settings.error());
  if (const std::string wrong = take_settings(options, *settings); !wrong.empty()) return complain(app, wrong);
  return std::nullopt;
}

}  // namespace farfeel::codecs
