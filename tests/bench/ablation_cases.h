// What each mechanism is there for: the hard cases that it names, and the scene in which its time is taken.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "haptic_core/ablation/ablation.h"

namespace farfeel::bench {

/// Scenes whose answers or ticks are timed: ablation_speed.h.
enum class Scene : std::uint8_t {
  kPlates,      ///< textured plates, an answer of the remote
  kSlowPlates,  ///< the same, at 5 mm/s
  kScrew,       ///< a textured nut on its bolt, felt as points
  kPeg,         ///< an untextured peg in its hole, in closed form
  kFile,        ///< a file over a textured part, up to seven contacts
  kFileTick,    ///< the same, contacts found in a tick at 4 kHz
  kLinearTick,  ///< a whole tick that feels a remote in closed form
  kTilesTick,   ///< a whole tick that finds its contacts between ridged plates
};

/// Rows of `hardcases loop`: at most so many, of the cases whose name contains `only`.
struct LoopPick {
  std::string_view only;
  std::string_view rung{};  ///< empty: any
  bool is_far = false;      ///< only rows with a link
  std::uint32_t most = 4;
};

struct AblationCase {
  Mechanism mechanism;
  Scene scene;
  std::vector<std::string_view> contact;  ///< cases of `hardcases contact`, by name
  std::vector<LoopPick> loop;
};
/// One of every mechanism, in their order.
[[nodiscard]] std::span<const AblationCase> ablation_cases();

}  // namespace farfeel::bench
