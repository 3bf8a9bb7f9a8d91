#include "deploy/front/config.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "codecs/settings/command_line.h"
#include "codecs/settings/settings.h"
#include "codecs/text/nearest_word.h"
#include "deploy/front/child.h"

extern char** environ;

namespace farfeel::front {
namespace {

using nlohmann::json;

/// Read by farfeel, and no option of any program.
constexpr std::array<std::string_view, 3> kOtherVariables = {"FARFEEL_NO_SETTINGS", "FARFEEL_INVERSE3",
                                                             "FARFEEL_DHD_LIBRARY"};

constexpr const char* kDocsHead = R"(# Options

Made by `farfeel config docs`, of the options as the programs register them; a test holds this page to that.

An option counts as it is set first: on the command line; in the environment (`--max-force` is `FARFEEL_MAX_FORCE`, for
every program that has it); in the user's file, `~/.config/farfeel/NAME.toml` or below `$XDG_CONFIG_HOME`; in the system's,
`/etc/farfeel/NAME.toml`. NAME is what stands behind `farfeel`: `master.toml` is a list such as

```toml
max_force = 4.5
device = "falcon"
no_view = true
```

`edit.toml` is of what edits, watches and saves the scene of a slave that runs.

A key that is not known, or a value beyond its limits, is told with file and line, and nothing is begun. A file counts only
where nobody but its reader and root may write it and its folder, because it may name a plug-in to load, keys to trust or
the user to become; under sudo, the caller's own files are passed over. `--no-settings` (`FARFEEL_NO_SETTINGS=1`) leaves
all of it out; so `farfeel loopback` starts its two stations, which take what `loopback.toml` says.

`farfeel config show master --origin` tells what is set and where, `farfeel config check` what is wrong with it. Every
program has `--help`, `--version` and `--no-settings`. What no file and no variable may set has no key.
)";

/// What takes settings: farfeel-edit too, to which `farfeel scene` leads; measurements take their command line alone.
std::vector<std::string_view> set_programs(std::span<const std::string_view> programs) {
  std::vector<std::string_view> all(programs.begin(), programs.end());
  std::replace(all.begin(), all.end(), std::string_view("bench"), std::string_view("edit"));
  return all;
}

std::string quoted(const std::string& word) {
  std::string all = "'";
  for (const char c : word) all += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return all + "'";
}

struct Answer {
  int status = 1;
  std::string text;  ///< of standard output; what is wrong was said on standard error
};

Answer ask(std::string_view program, const std::string& question, const std::string& file = {}) {
  const std::string command = fmt::format("{} {} {}{}", quoted(own_folder() + "/farfeel"), program, question,
                                          file.empty() ? "" : " " + quoted(file));
  Answer answer;
  std::FILE* const pipe = ::popen(command.c_str(), "re");
  if (pipe == nullptr) return answer;
  std::array<char, 4096> piece{};
  for (std::size_t got = 0; (got = std::fread(piece.data(), 1, piece.size(), pipe)) > 0;)
    answer.text.append(piece.data(), got);
  const int status = ::pclose(pipe);
  answer.status = WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  return answer;
}

/// Null where it said what is wrong.
json described(std::string_view program) {
  const Answer answer = ask(program, codecs::kDescribeOptions);
  return answer.status == 0 ? json::parse(answer.text, nullptr, false) : json();
}

std::string text(const json& option, const char* key) {
  return option.at(key).get<std::string>();
}

std::string name_of(const json& option) {
  return text(option, "command").empty() ? text(option, "name")
                                         : fmt::format("{} {}", text(option, "command"), text(option, "name"));
}

int no_program(std::string_view name, std::span<const std::string_view> programs, const std::string& where) {
  const std::string_view meant = codecs::nearest_word(name, programs);
  fmt::print(stderr, "{}: there is no program \"{}\"{}\n", where, name,
             meant.empty() ? fmt::format("; there are {}", fmt::join(programs, ", "))
                           : fmt::format("; did you mean \"{}\"?", meant));
  return codecs::kUsageError;
}

int show(std::span<const std::string_view> programs, bool with_origin) {
  int status = 0;
  for (const std::string_view program : programs) {
    const json all = described(program);
    if (!all.is_object()) {
      status = codecs::kUsageError;
      continue;
    }
    if (all.at("options").empty()) continue;
    fmt::print("{}\n", program);
    for (const json& option : all.at("options")) {
      const std::string value = text(option, "value");
      const std::string unit = value.empty() || text(option, "unit").empty() ? "" : " " + text(option, "unit");
      const std::string shown = (value.empty() ? "-" : value) + unit;
      fmt::print("{}\n", with_origin ? fmt::format("  {:<28} {:<28} {}", name_of(option), shown, text(option, "origin"))
                                     : fmt::format("  {:<28} {}", name_of(option), shown));
    }
  }
  return status;
}

int check_file(const std::string& path, std::span<const std::string_view> programs) {
  const std::string program = std::filesystem::path(path).stem();
  if (std::find(programs.begin(), programs.end(), program) == programs.end())
    return no_program(program, programs, path);
  if (!std::filesystem::exists(path)) {
    fmt::print(stderr, "{}: there is no such file\n", path);
    return codecs::kUsageError;
  }
  const int status = ask(program, codecs::kCheckSettings, path).status;
  if (status == 0) fmt::print("{}: right\n", path);
  return status;
}

/// FARFEEL_ variables that no program takes, and that look like one that some program does.
int check_environment(std::span<const std::string_view> programs) {
  std::vector<std::string> known(kOtherVariables.begin(), kOtherVariables.end());
  int status = 0;
  for (const std::string_view program : programs) {
    const json all = described(program);
    if (!all.is_object()) {
      status = codecs::kUsageError;
      continue;
    }
    for (const json& option : all.at("options")) known.push_back(codecs::variable_of(text(option, "key")));
  }
  for (char** each = environ; *each != nullptr; ++each) {
    const std::string_view name = std::string_view(*each).substr(0, std::string_view(*each).find('='));
    if (!name.starts_with("FARFEEL_") || std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string_view meant =
        codecs::nearest_word(name, std::vector<std::string_view>(known.begin(), known.end()));
    fmt::print(stderr, "{}: no program has such an option{}\n", name,
               meant.empty() ? "" : fmt::format("; did you mean {}?", meant));
    status = codecs::kUsageError;
  }
  return status;
}

int check_all(std::span<const std::string_view> programs) {
  int status = 0, files = 0;
  for (const std::string& folder : codecs::settings_folders()) {
    std::error_code none;
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none))
      if (entry.path().extension() == ".toml") paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    files += static_cast<int>(paths.size());
    for (const std::string& path : paths) status = std::max(status, check_file(path, programs));
  }
  if (files == 0) fmt::print("no files of settings in {}\n", fmt::join(codecs::settings_folders(), " and "));
  return status == 0 ? check_environment(programs) : status;
}

std::string cell(std::string words) {
  std::string all;
  for (const char c : words) all += c == '|' ? "\\|" : c == '\n' ? " " : std::string(1, c);
  return all;
}

int print_docs(std::span<const std::string_view> programs) {
  fmt::print("{}", kDocsHead);
  for (const std::string_view program : programs) {
    const json all = described(program);
    if (!all.is_object()) return codecs::kUsageError;
    if (all.at("options").empty()) continue;
    fmt::print("\n## farfeel {}\n\n| option | key | unit | default | limits | what |\n|---|---|---|---|---|---|\n",
               program);
    for (const json& option : all.at("options")) {
      const auto code = [&option](const char* key) {
        const std::string word = text(option, key);
        return word.empty() ? std::string() : fmt::format("`{}`", word);
      };
      fmt::print("| `{}` | {} | {} | {} | {} | {} |\n", name_of(option), code("key"), cell(text(option, "unit")),
                 code("default"), cell(text(option, "limits")), cell(text(option, "help")));
    }
  }
  return 0;
}

}  // namespace

int config_command(int argc, char** argv, std::span<const std::string_view> all) {
  CLI::App app("What is set for which program, and where.", "farfeel config");
  app.require_subcommand(1);
  CLI::App* const shown = app.add_subcommand("show", "Every option's value");
  std::string program, file;
  bool with_origin = false;
  shown->add_option("PROGRAM", program, "As in farfeel PROGRAM; all of them unless told");
  shown->add_flag("--origin", with_origin, "And where it comes from: a file's line, a variable, the default");
  CLI::App* const checked = app.add_subcommand("check", "What is wrong with files of settings and variables");
  checked->add_option("FILE", file, "NAME.toml alone; all that count here unless told");
  CLI::App* const docs = app.add_subcommand("docs", "Print docs/options.md");
  app.footer("Exit status: 0, or 2 where a setting is wrong.");
  if (const auto done = codecs::parse_command_line(app, argc, argv)) return *done;

  std::vector<std::string_view> programs = set_programs(all);
  if (docs->parsed()) {
    ::setenv("FARFEEL_NO_SETTINGS", "1", 1);
    return print_docs(programs);
  }
  if (checked->parsed()) return file.empty() ? check_all(programs) : check_file(file, programs);
  if (!program.empty()) {
    if (std::find(programs.begin(), programs.end(), program) == programs.end())
      return no_program(program, programs, "farfeel config");
    programs = {program};
  }
  return shown->parsed() ? show(programs, with_origin) : 0;
}

}  // namespace farfeel::front
