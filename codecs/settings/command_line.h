// How every program takes its command line, so that the same mistake is told in the same words and ends with the same
// status everywhere.
#pragma once

#include <optional>

namespace CLI {
class App;
}

namespace farfeel::codecs {

inline constexpr int kUsageError = 2;  ///< the exit status of a command line that is wrong

/// Adds --version, parses, and says what has to be said. Numbers have to be finite, those without a sign not negative;
/// of an option or a command that is not known the nearest one is named. Returns the exit status where the program is
/// done: 0 after --help and --version, kUsageError where the command line is wrong. Nothing is changed before this.
[[nodiscard]] std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

}  // namespace farfeel::codecs
