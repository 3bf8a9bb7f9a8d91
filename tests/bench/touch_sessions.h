// Simulated hands that press, stroke and jab, in closed loop and simulated time, and whether the tool ever goes through
// what it touches, or sinks in without a force.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "haptic_core/local_model/local_model.h"
#include "tests/bench/felt_pair.h"
#include "tests/bench/touch_assets.h"
#include "tests/bench/touch_places.h"
#include "transport/link/link_spec.h"

namespace farfeel::bench {

enum class HandMotion { kPress, kStroke, kJab };
[[nodiscard]] std::string_view name(HandMotion);

struct SessionPlan {
  HandMotion motion = HandMotion::kPress;
  local_model::Rung rung = local_model::Rung::kTiles;
  double hand_N = 3;  ///< the hand leans in so hard, held
  Place place;
  transport::LinkSpec link;
};

struct SessionFigures {
  int through_ms = 0;        ///< longest time behind the surface with less than half of what should push back
  int without_force_ms = 0;  ///< longest time without force, deeper than the asset may be off by
  double first_touch_m = 0;  ///< deepest before the first force came
  double deepest_m = 0;      ///< of all
  bool is_behind_at_end = false;
  bool is_fault = false;

  static constexpr int kMostThrough_ms = 10;
  [[nodiscard]] bool is_through() const { return through_ms > kMostThrough_ms; }
};

/// Where a ball's middle is, from tick to tick: before the surface that it came to, or behind it.
class SideWatch {
 public:
  /// At first it is outside.
  SideWatch(const TouchTruth& truth, const glm::dvec3& p_O) : truth_(truth), last_O_(p_O) {}
  /// The way out for a ball of that radius, its middle now at p_O.
  [[nodiscard]] WayOut move_to(const glm::dvec3& p_O, double radius_m);
  [[nodiscard]] bool is_behind() const { return is_behind_; }

 private:
  const TouchTruth& truth_;
  glm::dvec3 last_O_, out_O_{0, 0, 1};
  bool is_behind_ = false;
};

/// The tool is a ball.
[[nodiscard]] SessionFigures run_session(const FeltPair&, const TouchSubject&, const TouchTool&, const SessionPlan&);

struct SessionChoice {
  std::vector<std::string> models;  ///< empty: those of kSessionModels
  std::string scans;                ///< a folder
  std::uint64_t seed = 1;
  std::uint32_t sessions = 200;  ///< about; half of them across the bad link
  bool is_anew = false;          ///< assets are baked whether or not the cache has them
};
/// The same hand at the same place, without a link and across the bad one; a row for each model, link and force. Prints
/// a table and what the goals say; returns sessions[] as JSON.
[[nodiscard]] nlohmann::json run_sessions(const SessionChoice&);

}  // namespace farfeel::bench
