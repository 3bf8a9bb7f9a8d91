// The counts of earlier builds: one JSON object a line, oldest first, so that a change of one is a line of its own.
//   {"commit": "...", "date": "...", "why": "...", "lacking": "...", "counts": {"frame/file-cad": {"samples": 1, ...},
//   ...}}
// "lacking" says what could not be counted then, if anything.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/bench/counted_motions.h"

namespace farfeel::bench {

/// A count may differ by this share of the recorded one, either way: compilers and C libraries round their own way.
inline constexpr double kSameWork = 0.03;

struct WorkDifference {
  std::string row, counter;
  std::uint64_t before = 0, now = 0;
};

class WorkHistory {
 public:
  /// Throws CLI::Error where the file can't be read, or holds something else.
  explicit WorkHistory(const std::filesystem::path& path);

  [[nodiscard]] const std::vector<nlohmann::json>& entries() const { return entries_; }
  /// What differs from the newest entry by more than kSameWork; of the rows that were counted. A count that was none,
  /// or is none, differs.
  [[nodiscard]] std::vector<WorkDifference> differences(const std::vector<CountedRow>& now) const;

 private:
  std::vector<nlohmann::json> entries_;
};

[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<CountedRow>&);
/// Adds a line. Today's date is the machine's.
void add_to_history(const std::filesystem::path& path, const std::string& commit, const std::string& why,
                    const std::vector<CountedRow>&);

}  // namespace farfeel::bench
