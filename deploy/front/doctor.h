// `farfeel doctor`: what this machine can do for a haptic loop, line by line, and what to do about what it can't.
#pragma once

#include <string>
#include <vector>

namespace farfeel::front {

enum class Health { kGood, kLimited, kMissing };

struct Finding {
  std::string what;  ///< "real-time scheduling"
  Health health = Health::kGood;
  std::string seen;    ///< what was found
  std::string remedy;  ///< what to do; empty when good
};

/// Takes about two seconds, most of them to measure the loop's jitter.
[[nodiscard]] std::vector<Finding> examine_this_machine();

/// Prints them, or one JSON object {"is_all_there", "findings": [{"what", "health", "seen", "remedy"}]}; returns 0 when
/// nothing is missing, else 1. all_there and else_words: the last line.
[[nodiscard]] int tell_findings(const std::vector<Finding>&, bool as_json, const std::string& all_there,
                                const std::string& else_words);

}  // namespace farfeel::front
