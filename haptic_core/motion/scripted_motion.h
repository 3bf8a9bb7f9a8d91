// A scene object that moves by a script: key poses at given times, and a smooth way between them, whatever pushes.
//
// Scene time is the master's: it begins with its haptic loop and travels with every tool pose. Both ends look up the
// script at the same scene time, so no delay of the link ever shows in where an object is.
//
// Between two keys position is a cubic Hermite curve, rotation a cubic Bezier curve of rotations (Kim, Kim & Shin
// 1995); velocities at the keys are those of the parabola through a key and its neighbours. Velocity is continuous
// everywhere.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::motion {

struct Keyframe {
  double at_s = 0;  ///< scene time, from 0 on, growing
  spatial::Pose X_WO;
};

/// After the last key: the object stays there, at rest at both ends of the script; or it begins again, as smoothly as
/// anywhere: the last key's pose is then the first's.
enum class Afterwards { kStays, kRepeats };

inline constexpr std::size_t kMostKeyframes = 256;
inline constexpr double kLeastGap_s = 1e-3;  ///< between two keys
inline constexpr double kLongestScript_s = 1e5;

/// Where an object is and how it moves.
struct Placement {
  spatial::Pose X_WO;
  spatial::Twist V_WO_W;  ///< of O's origin
  bool is_there = true;
};

/// What is wrong with a script, if anything: too few or too many keys, times that do not grow, poses that are none, a
/// last key that a repeating script cannot begin from.
[[nodiscard]] std::optional<std::string> fault_of(std::span<const Keyframe>, Afterwards) noexcept;

class ScriptedMotion {
 public:
  /// Precondition: fault_of() finds none.
  ScriptedMotion(std::span<const Keyframe> keys, Afterwards afterwards);

  /// At any scene time; before the first key the object waits there. Realtime-safe, any number of threads.
  [[nodiscard]] Placement at(double scene_s) const noexcept;

  [[nodiscard]] std::span<const Keyframe> keys() const { return keys_; }
  [[nodiscard]] Afterwards afterwards() const { return afterwards_; }

 private:
  std::vector<Keyframe> keys_;
  std::vector<spatial::Twist> V_W_;  // at each key, of O's origin
  Afterwards afterwards_;
};

}  // namespace farfeel::motion
