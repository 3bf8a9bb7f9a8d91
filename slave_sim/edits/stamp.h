// A ball pressed into a surface that is felt, as new height tiles.
//
// What is inside the ball is taken away: with the ball's centre C = (C_s, C_t, C_z) and radius r in a chart's frame, a
// coefficient c at (s, t) inside it becomes the ball's lower side there,
//   C_z - sqrt(r^2 - (s - C_s)^2 - (t - C_t)^2).
// The height field is then off that side by its own smoothing, a quarter of a texel squared over r, and rounds the rim
// over a texel. The same stamp again changes nothing.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "haptic_core/contact/touchable.h"
#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::slave_sim {

using contact::SurfaceEdit;

struct Stamp {
  glm::dvec3 p_O{0};    ///< within a radius of the place: the nearest point of the coarse surface is meant
  double radius_m = 0;  ///< of the ball, > 0
  double depth_m = 0;   ///< of the ball's lowest point below the surface there; > 0, at most the radius
};

/// The same surface, with so much room below its heights for stamps. Its scale grows coarser only where the range of
/// what is stored, 65,536 steps, is too small for both.
void make_room(geometry::HapticSurface& surface, double room_m);
/// The same surface without room below its lowest height.
void take_room_back(geometry::HapticSurface& surface);

/// New tiles of the surface that is `number` of its scene, for those that the stamp changes. Refused, with what is
/// possible, where no surface is within its radius or none with texture, where it is deeper than kMostOfThickness of
/// the material, or where the heights' range ends.
[[nodiscard]] tl::expected<std::vector<SurfaceEdit>, std::string> stamped(const geometry::HapticSurface& surface,
                                                                          std::uint32_t number, const Stamp& stamp);

/// A stamp is at most so much of the material's thickness deep, where that is known: a height field has no other side.
inline constexpr double kMostOfThickness = 0.5;

}  // namespace farfeel::slave_sim
