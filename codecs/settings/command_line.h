// How every program takes its command line, so that the same mistake is told in the same words and ends with the same
// status everywhere.
#pragma once

#include <optional>

namespace CLI {
class App;
}

namespace farfeel::codecs {

inline constexpr int kUsageError = 2;  ///< the exit status of a command line that is wrong

/// What `farfeel config` asks of a program, as its first argument: its options as JSON, or what is wrong with a file.
inline constexpr const char* kDescribeOptions = "--describe-options";
inline constexpr const char* kCheckSettings = "--check-settings";

/// Adds --version and --no-settings, parses, takes what is set elsewhere (settings.h) for options that were not given,
/// and says what has to be said. Numbers have to be finite, those without a sign not negative; of an option, a command
/// or a key that is not known the nearest one is named. Returns the exit status where the program is done: 0 after
/// --help and --version, kUsageError where the command line or a setting is wrong. Nothing is changed before this; a
/// station calls it before it is confined, so that files that its confinement hides are read.
[[nodiscard]] std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

}  // namespace farfeel::codecs
