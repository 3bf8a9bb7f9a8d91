// Depths of hard patterns against truth, where a contact is asked afresh and where it has slid to its pose.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace farfeel::bench {

struct SlidOptions {
  std::vector<std::string> patterns;  ///< of support/plate_patterns.h; none: all
  std::vector<double> widths_m = {10e-6, 20e-6, 50e-6, 200e-6};
  std::vector<std::uint32_t> samples = {50, 100};
  std::size_t poses = 2;  ///< of each pattern
  unsigned seed = 1;
};

/// A row for each pattern, width and N: how far answers are from truth, slid ones from fresh ones, what is flagged of
/// right and wrong ones, the greatest change of force in a step of 1 um, and the time of a slid answer.
[[nodiscard]] nlohmann::json slid_rows(const SlidOptions&);

}  // namespace farfeel::bench
