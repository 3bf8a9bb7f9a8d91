// Places on a model where a tool presses, and what the contact service says there beside what is true.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "haptic_core/contact_service/contact_service.h"
#include "tests/bench/touch_assets.h"

namespace farfeel::bench {

/// Where a tool touches first, and how it comes: straight along out_O.
struct Place {
  glm::dvec3 p_touch_O{0};  ///< the tool's origin, touching
  glm::dvec3 out_O{0};
  glm::dquat R_OT{1, 0, 0, 0};
  double free_way_m = 0;  ///< at least so far out it is free all along
  double speed_m_s = 0;

  [[nodiscard]] spatial::Pose X_OT(double pressed_m) const { return {R_OT, p_touch_O - pressed_m * out_O}; }
  /// For the truth.
  [[nodiscard]] RoundToolPose round_pose(double pressed_m) const;
};

/// The index-th place of a model and tool: a function of these and the seed. None where the point that was drawn, and
/// all that were drawn after it, have no way in.
[[nodiscard]] std::optional<Place> place_on(const TouchSubject&, const TouchTool&, std::uint64_t seed,
                                            std::uint32_t index);

/// What the random numbers of a model's and tool's place begin with: its own, whatever was drawn before.
[[nodiscard]] std::uint64_t seed_of(const std::string& model, const std::string& tool, std::uint64_t seed,
                                    std::uint32_t index);

/// How far out of a place the tool is free all along, at most longest_m; 0 where it is not even at the first touch.
[[nodiscard]] double free_way_m(const TouchSubject&, const TouchTool&, const Place&, double longest_m);

/// What was told at one pose, and what is true there.
struct Told {
  double pressed_m = 0;  ///< along the way in, from the first touch; < 0: before it
  TrueTouch truth;
  glm::dvec3 force_N{0};
  double depth_m = 0;  ///< of the deepest contact; 0 without any
  std::uint8_t doubts = 0;
  double angle_rad = 0;  ///< of the force to the truth; NaN without force
};

/// The deepest contact of an answer.
struct ToldDepth {
  double depth_m = 0;       ///< 0 without any
  std::uint8_t doubts = 0;  ///< of its depth
};
[[nodiscard]] ToldDepth told_depth(const contact::ContactSet&);

/// The tool comes in along the place's way and stops at each of the depths, which ascend. The approach's poses before
/// the first touch come first.
struct Pressed {
  std::vector<Told> before;  ///< apart
  std::vector<Told> at;      ///< one a depth
};

/// With the options that programs which render ask for. The object's frame is the world's.
[[nodiscard]] contact_service::ContactService touch_service(const TouchSubject&, const TouchTool&);

/// Presses one tool on one model. Not for several threads at once; the subject and tool outlive it.
class Presser {
 public:
  Presser(const TouchSubject&, const TouchTool&);
  [[nodiscard]] Pressed press(const Place&, const std::vector<double>& depths_m);

 private:
  [[nodiscard]] Told ask(const Place&, double pressed_m, double speed_m_s);

  const TouchSubject& subject_;
  const TouchTool& tool_;
  contact_service::ContactService service_;
  std::int64_t time_ns_ = 0;
  std::uint32_t sequence_ = 0;
};

inline constexpr double kNoForce_N = 0.01;    ///< less is none: 10 um of a contact between default materials
inline constexpr double kFalseForce_N = 0.1;  ///< more, where nothing is near, is felt

/// What is wrong at one place, pressed to one depth.
struct Verdict {
  bool missed = false, is_false = false, inward = false, unflagged = false;
  bool is_right = false, is_flagged = false;
};
[[nodiscard]] Verdict judge(const Told& at, const std::vector<Told>& before, double allowed_m);

}  // namespace farfeel::bench
