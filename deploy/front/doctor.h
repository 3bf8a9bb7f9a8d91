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

/// Prints the findings; returns 0 when nothing is missing, else 1.
[[nodiscard]] int run_doctor();

}  // namespace farfeel::front
