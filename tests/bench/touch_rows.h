// Verdicts of many places as rows of a table, and the first few failures of each kind, to be looked at again.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/bench/touch_places.h"
#include "tests/support/quantile.h"

namespace farfeel::bench {

using support::quantile;

/// One model, tool and depth; or a sum of several.
struct TouchRow {
  std::uint64_t places = 0, missed = 0, is_false = 0, inward = 0, unflagged = 0;
  std::uint64_t right = 0, right_flagged = 0;
  std::uint64_t past_middle = 0, squeezed = 0;
  std::vector<float> angles_deg, depth_errors_um;  ///< of what has force; of what truly overlaps

  void add(const Told& at, const Verdict&);
  void add(const TouchRow&);
  [[nodiscard]] double flagged_right() const;  ///< in [0, 1]
};

/// A place where something is wrong.
struct TouchFailure {
  std::string kind, model, tool;
  std::uint64_t seed = 0;
  std::uint32_t index = 0;
  Told at;
  std::vector<Told> before;
  Place place;
};

class TouchFailures {
 public:
  static constexpr std::size_t kTold = 6;                ///< of each kind
  static constexpr const char* kAskedFor = "asked for";  ///< a kind of which all are told
  void add(TouchFailure);
  void add(const TouchFailures&);
  /// One line each: where, how to see it again, what was told and what is true.
  void print() const;

 private:
  std::map<std::string, std::vector<TouchFailure>> by_kind_;
};

[[nodiscard]] nlohmann::json row_json(const std::string& model, const std::string& tool, double press_m,
                                      const TouchRow&, double allowed_m);

}  // namespace farfeel::bench
