// Hard cases one by one, by place in a list: which there are, and how they do with what is left out just now.
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include "tests/bench/hardcases_contact.h"
#include "tests/bench/hardcases_loop.h"

namespace farfeel::bench {

/// One row as it was judged.
struct JudgedRow {
  std::string name;
  bool passes = false;
  double force_off = 0;  ///< of a row of the loop behind a link: how far its force is off that without one, as a share
};

class AblationRows {
 public:
  AblationRows();

  [[nodiscard]] const std::vector<HardCase>& contact() const { return contact_; }
  /// Without figures; every row of `hardcases loop` at 1 kHz.
  [[nodiscard]] const std::vector<LoopCaseRow>& loop() const { return loop_; }
  /// The row of the same case, tool, hand and rung without a link.
  [[nodiscard]] std::size_t without_link(std::size_t row) const { return without_link_[row]; }

  /// Runs them on every core. Cases of `hardcases contact` may have several rows; of the loop there are also those
  /// without a link that others are judged by.
  [[nodiscard]] std::vector<JudgedRow> judge(const std::set<std::size_t>& contact,
                                             const std::set<std::size_t>& loop) const;

 private:
  std::vector<HardCase> contact_;
  std::vector<LoopCaseRow> loop_;
  std::vector<std::size_t> families_;  // the first row of each family of the loop's, and the end
  std::vector<std::size_t> without_link_;
};

}  // namespace farfeel::bench
