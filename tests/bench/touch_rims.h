// Force where nothing is touched: what the contact service tells a ball that passes by the free edges of models, clear
// of them, and whether it tells when the same edges are pressed. Truth is the ball's distance to the original mesh.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <vector>

#include "haptic_core/contact/doubts.h"
#include "tests/bench/touch_edges.h"

namespace farfeel::bench {

/// One answer of a passage.
struct PassageTick {
  double clear_m = 0;  ///< truly
  ToldDepth told;
  const contact::ContactSet& set;
};
using PassageWitness = std::function<void(const PassageTick&)>;

/// What one passage was told.
struct Passed {
  double force_N = 0;       ///< the greatest
  bool is_pushed = false;   ///< by more than kFalseForce_N, while it was clear by more than the asset may be off
  std::uint8_t doubts = 0;  ///< of any answer
  bool is_off_flagged = false, is_off_unflagged = false;  ///< an answer's depth, by more than the asset may be off
  Told pressed{};
  bool is_missed = false;  ///< pressed
};

/// Carries one ball along passages of one model. Not for several threads at once; the subject and ball outlive it.
class Carrier {
 public:
  Carrier(const TouchSubject&, const TouchTool& ball);
  [[nodiscard]] Passed carry(const Passage&, const PassageWitness& = {});

 private:
  const TouchSubject& subject_;
  const TouchTool& ball_;
  contact_service::ContactService service_;
  Presser presser_;
};

struct RimRow {
  std::uint64_t passages = 0, pushed = 0, missed_pressed = 0;
  std::uint64_t flagged = 0, right_flagged = 0, off_unflagged = 0;
  std::array<std::uint64_t, contact::kNamedDoubts.size()> doubted{};  ///< a passage counts in each of its doubts
  double force_N_max = 0;

  void add(const Passed&);
  void add(const RimRow&);
};

struct RimChoice {
  std::vector<TouchModel> models;
  std::uint64_t seed = 1;
  std::uint32_t passages = 3'000;  ///< about, in all
  std::int64_t only = -1;          ///< of each model only this one, told answer by answer
  bool is_anew = false;            ///< assets are baked whether or not the cache has them
};
/// Prints a table and what the goals say; returns rims[] as JSON: a row for each model and distance.
[[nodiscard]] nlohmann::json run_rims(const RimChoice&);

}  // namespace farfeel::bench
