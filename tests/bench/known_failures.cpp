#include "tests/bench/known_failures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace farfeel::bench {
namespace {

struct Known {
  HardCases cases;
  std::string_view name, figure;  ///< no figure: all rows of that name
  std::string_view reason;
};

// docs/measured.md says more of each.
constexpr std::array kKnown = {
    Known{HardCases::kContact, "textured peg in hole", "depth against dense points",
          "13.8 um off: the wall's pieces leave a contact a quarter of its area, w ln 4 less (not proven)"},
    Known{HardCases::kContact, "nut on bolt, at rest", "force",
          "0.07 N: the soft maximum of flanks that are 0.08 mm apart nearly touches"},
    Known{HardCases::kLoop, "jab at a bowl of 3 mm, inside", "", "the ball is behind the wall for longer than 10 ms"},
};

}  // namespace

std::string_view known_failure(HardCases cases, std::string_view name, std::string_view figure) {
  const auto found = std::find_if(kKnown.begin(), kKnown.end(), [&](const Known& known) {
    return known.cases == cases && known.name == name && (known.figure.empty() || known.figure == figure);
  });
  return found == kKnown.end() ? std::string_view{} : found->reason;
}

std::string CountedRows::count(HardCases cases, bool passes, std::string_view name, std::string_view figure) {
  const std::string_view why = known_failure(cases, name, figure);
  ++rows_;
  failed_ += !passes;
  if (why.empty()) {
    unknown_ += !passes;
    return passes ? "ok" : "FAILS";
  }
  const std::string row = figure.empty() ? std::string(name) : fmt::format("{}, {}", name, figure);
  std::string line = passes ? fmt::format("holds, and is known to fail: {} (take it out of known_failures.cpp)", row)
                            : fmt::format("known to fail: {}: {}", row, why);
  if (std::find(told_.begin(), told_.end(), line) == told_.end()) told_.push_back(std::move(line));
  return passes ? "holds, known to fail" : "fails, known";
}

void CountedRows::print() const {
  for (const std::string& line : told_) fmt::print("{}\n", line);
  fmt::print("{} of {} rows fail, {} of them unknown\n", failed_, rows_, unknown_);
}

}  // namespace farfeel::bench
