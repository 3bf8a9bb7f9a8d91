// One contact as a row: a half-space of tool poses that may not be left, felt through an elastic pad.
// Frames: W world, S scene object, T tool, C the contact, Q the pose at which the rows were looked up. SI units.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::constraint {

/// Contacts that one tick can hold. Memory and time are bounded by it.
inline constexpr int kMaxRows = 32;

/// What a row pushes with at most. It keeps numbers finite where a scene squeezes the tool, and nothing else: four
/// times the strongest force asked of any scene. What a device may give is limited after the coupling.
inline constexpr double kMostPush_N = 200;

struct Row {
  std::uint64_t name = 0;  ///< stays with the contact from tick to tick: what it pushed with is found again by it

  double depth_m = 0;  ///< of T at X_WQ along nhat_ST_W, with S where it will be at the tick's end; below 0 is apart
  /// The part of the depth that is not felt; the proxy is on the surface all the same. Below 0: felt deeper than it is.
  double recess_m = 0;
  /// d depth / d (rotation [m/rad], translation [1]) of T about To at X_WQ. On a slope it leans from the direction.
  spatial::Vector6 gradient = spatial::Vector6::Zero();
  glm::dvec3 nhat_ST_W{0, 0, 1};  ///< unit normal out of S, into T: which way the pad yields
  glm::dvec3 p_ToC_W{0};          ///< at X_WQ: where friction acts

  double stiffness_N_per_m = 1000;  ///< of the pad, > 0
  double damping_Ns_per_m = 0;      ///< >= 0
  double most_N = kMostPush_N;      ///< >= 0

  double static_friction = 0;   ///< coefficient [1], >= dynamic_friction
  double dynamic_friction = 0;  ///< coefficient [1], >= 0
  /// Of the patch that touches: it resists turning about nhat_ST_W. 0 where it is not known.
  double patch_radius_m = 0;

  spatial::Vector6 V_WS_W = spatial::Vector6::Zero();  ///< of S, taken at To
};

/// What yields between tool and row.
enum class Pad : std::uint8_t {
  kOne,     ///< one elastic pad for all rows: however many report a place, it yields there once
  kSprings  ///< a spring of its own for each row: penalty, the comparator; there is no proxy then
};

struct Law {
  Pad pad = Pad::kOne;
  /// e: what a row yields by itself [m/N]. It makes duplicates solvable. Of kSprings: 0, the springs do.
  double row_compliance_m_per_N = 3e-6;
  /// Tangential over normal stiffness of kSprings, 2 (1 - nu) / (2 - nu) at nu = 0.3. Mindlin, J. Applied Mechanics 16,
  /// 1949.
  double tangential_share = 0.82;
};

/// e <= min(3e-6 m/N, 0.01 / K). At 4 N the first is 12 um of depth, which no hand feels; the second takes one percent
/// of the stiffness that a stiff wall shows behind a coupling of K.
[[nodiscard]] constexpr double row_compliance_m_per_N(double coupling_N_per_m) noexcept {
  return coupling_N_per_m > 0 ? std::min(3e-6, 0.01 / coupling_N_per_m) : 3e-6;
}
[[nodiscard]] constexpr Law one_pad(double coupling_N_per_m) noexcept {
  return {.pad = Pad::kOne, .row_compliance_m_per_N = row_compliance_m_per_N(coupling_N_per_m)};
}
[[nodiscard]] constexpr Law springs() noexcept {
  return {.pad = Pad::kSprings, .row_compliance_m_per_N = 0};
}

}  // namespace farfeel::constraint
