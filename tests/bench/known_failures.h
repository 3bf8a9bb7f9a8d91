// Rows of `farfeel-bench hardcases` that fail today, each with its reason. Any other row that fails, fails the command
// and its test; a row of this list that holds is told, so that somebody takes it out.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace farfeel::bench {

enum class HardCases { kContact, kLoop };

/// Why this row is known to fail; empty where it is not. `figure`: of a contact frame, the figure; of the loop,
/// anything.
[[nodiscard]] std::string_view known_failure(HardCases, std::string_view name, std::string_view figure = {});

/// Counts a command's rows.
class CountedRows {
 public:
  /// Returns the row's verdict: "ok", "FAILS", or for known rows "fails, known" and "holds, known to fail".
  std::string count(HardCases, bool passes, std::string_view name, std::string_view figure = {});
  /// How many fail, and of known rows why, or that they hold.
  void print() const;
  [[nodiscard]] int failed() const { return failed_; }    ///< known or not
  [[nodiscard]] int unknown() const { return unknown_; }  ///< failed, but not known

 private:
  int rows_ = 0, failed_ = 0, unknown_ = 0;
  std::vector<std::string> told_;
};

}  // namespace farfeel::bench
