// The line that tells how a session is going.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace farfeel::front {

/// What farfeel-master says with --progress machine: "progress t=3.2 of=20 state=touching force=2.31 contacts=4
/// rtt=1.2", in seconds, newtons and milliseconds. Fields may come in any order; unknown ones are ignored; "nan" is
/// allowed.
struct Progress {
  double t_s = 0, of_s = 0, force_N = 0, contacts = 0, rtt_ms = 0;
  std::string state;
};

/// Nothing when the line is no progress line.
[[nodiscard]] std::optional<Progress> progress_from(std::string_view line);

/// One line for people, without an end of line, at most 79 columns.
[[nodiscard]] std::string shown(const Progress&);

}  // namespace farfeel::front
