// How far tool T has sunk into scene object S along one direction, and how that changes as T moves.
//
// In the contact frame C the z axis points out of S and into T. Over C's x-y plane both displaced surfaces are height
// fields: S by its outermost height z_S(u, v), T by its innermost z_T(u, v). The local overlap is d = z_S - z_T and
//   hard:  depth = max d
//   soft:  depth = w ln[(1 / a0) integral exp(d / w) du dv]     (w the soft width, a0 a fixed reference area).
// By the envelope theorem the derivative of either follows from T's slopes where d is large:
//   d depth / d translation = -N,   d depth / d rotation = -(p - To) x N,   N = (-dz_T/du, -dz_T/dv, 1).
// Source: directional penetration depth of Otaduy, Jain, Sud and Lin 2004, section 5, there as a maximum on a raster
// with central differences.
#pragma once

#include <cstdint>
#include <limits>

#include "haptic_core/spatial/spatial.h"

namespace farfeel::penetration {

/// What a depth's user should know before believing it. Bits of Penetration::doubts.
enum Doubt : std::uint32_t {
  kNoOverlap = 1u << 0,      ///< the patches share no part of the window: every number is NaN
  kBorder = 1u << 1,         ///< the depth is decided at the window's border: the window was too small
  kSilhouette = 1u << 2,     ///< it is decided where S or T ends: an edge or corner touches
  kGrazing = 1u << 3,        ///< a surface there stands steeper than 70 degrees to C's x-y plane
  kSeveralLayers = 1u << 4,  ///< a patch covers itself along z; its outermost layer was taken
  /// The depth may be off by more than 0.5 um and 0.5 %: more touches, or more finely, than could be summed, and what
  /// was summed says so by its spread.
  kCoarseSteps = 1u << 5,
};

struct Penetration {
  glm::dvec3 p_CQ_C{std::numeric_limits<double>::quiet_NaN()};  ///< contact point Q, on T's surface [m]
  double depth_m = std::numeric_limits<double>::quiet_NaN();    ///< > 0 overlaps, < 0 apart
  /// d depth / d (rotation [m/rad], translation [1]) of T about To, in C; the rotation acts from the left.
  spatial::Vector6 gradient = spatial::Vector6::Constant(std::numeric_limits<double>::quiet_NaN());
  /// Second derivative in the same coordinates; zero unless the query asked for it.
  spatial::Matrix6 hessian = spatial::Matrix6::Zero();
  std::uint32_t doubts = kNoOverlap;

  [[nodiscard]] bool is_known() const { return (doubts & kNoOverlap) == 0; }
};

}  // namespace farfeel::penetration
