// A simulated person's intent: bring the tool to the surface, press, stroke to and fro, twist, lift, go elsewhere.
//
// The same seed gives the same motion for the same felt forces, at any tick rate: it lives in steps of 1 ms.
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "codecs/scene/exploration.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::master_station {

struct ExplorerSettings {
  codecs::Exploration hints;
  spatial::Pose X_TG;             ///< where the handle sits in the tool
  double hand_stiffness_N_per_m;  ///< of the grip that follows the intent: converts force errors to motion
  std::uint64_t seed = 1;
};

/// Where the hand wants the handle. Realtime-safe after construction.
class Explorer {
 public:
  static constexpr double kStep_s = 1e-3;
  enum class Phase : std::uint8_t { kApproach, kPress, kStroke, kTwist, kLift };

  explicit Explorer(const ExplorerSettings&);

  /// What it can press with, at most, on what is as hard as a wall, through a hand and a coupling in series that are so
  /// stiff together: beyond, it has gone so far below the region that it gives up and lifts.
  [[nodiscard]] static double most_press_N(const codecs::Exploration&, double stiffness_N_per_m) noexcept;

  /// One step of 1 ms. F_hand_W is what the hand feels now; it answers some 40 ms later.
  void advance(const spatial::Wrench& F_hand_W) noexcept;

  [[nodiscard]] spatial::Pose X_WHand() const noexcept;  ///< intended pose of the handle
  [[nodiscard]] const spatial::Twist& V_WHand_W() const noexcept { return V_WHand_W_; }  ///< mean over the last step
  [[nodiscard]] Phase phase() const noexcept { return phase_; }

 private:
  static constexpr std::size_t kReactionSteps = 40;

  struct Plane {
    double u = 0, v = 0;  // along across_[0], across_[1], from the region's centre [m]
  };
  void enter(Phase) noexcept;
  void begin_stroke() noexcept;
  void regulate(double felt_N) noexcept;
  [[nodiscard]] double uniform(double low, double high) noexcept;
  [[nodiscard]] Plane any_place() noexcept;

  ExplorerSettings settings_;
  std::mt19937_64 random_;
  glm::dvec3 centre_W_;
  std::array<glm::dvec3, 2> across_W_;
  std::array<double, 2> half_extent_m_;
  double half_depth_m_;
  glm::dquat R_WT_facing_;  // the tool's working face turned to the surface

  Phase phase_ = Phase::kApproach;
  double phase_s_ = 0, phase_length_s_ = 0;
  double stroke_s_ = 0, stroke_length_s_ = 0;
  Plane from_, to_, at_;
  double advance_m_ = 0;  // along approach_W, from the centre
  double yaw_rad_ = 0, yaw_rest_rad_ = 0, twist_rad_ = 0;
  std::array<double, kReactionSteps> felt_N_{};
  std::size_t felt_next_ = 0;
  spatial::Twist V_WHand_W_;
};

}  // namespace farfeel::master_station
