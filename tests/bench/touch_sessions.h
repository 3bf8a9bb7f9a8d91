// Simulated hands that press, stroke and jab, in closed loop and simulated time, and whether the tool ever goes through
// what it touches, or sinks in without a force.
#pragma once

#include <cstdint>
#include <functional>
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
  local_model::ContactLaw contact = local_model::ContactLaw::kPenalty;
  double hand_N = 3;  ///< the hand leans in so hard, held
  Place place;
  transport::LinkSpec link;
  std::uint64_t link_seed = 1;  ///< of what it delays and loses
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

/// One tick of a session, as its judge sees it.
struct SessionTick {
  int time_ms = 0;  ///< since the hand set off
  WayOut way;
  glm::dvec3 p_O{0}, force_N{0};  ///< the tool's middle, and the force of the contacts on it
  double hand_N = 0;
  bool is_behind = false;
};
using SessionWitness = std::function<void(const SessionTick&)>;

/// The tool is a ball.
[[nodiscard]] SessionFigures run_session(const FeltPair&, const TouchSubject&, const TouchTool&, const SessionPlan&,
                                         const SessionWitness& = {});

struct SessionChoice {
  std::vector<std::string> models;  ///< empty: those of kSessionModels
  std::string scans;                ///< a folder
  std::uint64_t seed = 1;
  std::uint32_t sessions = 200;  ///< about; half of them across the bad link
  std::int64_t only = -1;        ///< of each model only the hand of this number, told tick by tick
  local_model::ContactLaw contact = local_model::ContactLaw::kPenalty;
  bool is_anew = false;  ///< assets are baked whether or not the cache has them
};
/// The same hand at the same place, without a link and across the bad one; a row for each model, link and force. Prints
/// a table and what the goals say; returns sessions[] as JSON.
[[nodiscard]] nlohmann::json run_sessions(const SessionChoice&);

}  // namespace farfeel::bench
