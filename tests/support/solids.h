// Closed untextured solids in closed form, cut into convex pieces: shapes whose contacts can be written down, and some
// whose contacts are no height field.
#pragma once

#include <functional>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::support {

/// A closed, oriented mesh as a felt surface without texture, cut into convex pieces.
[[nodiscard]] geometry::HapticSurface untextured(geometry::TriangleMesh mesh);

[[nodiscard]] geometry::TriangleMesh box_mesh(const glm::dvec3& size_m);

/// Radius and height of one point of a profile [m].
struct ProfilePoint {
  double r_m, z_m;
};
/// Rows of points around the z axis: row i at angle theta is profile(i, theta). Rows from the first to the last run
/// counter-clockwise in the (r, z) half plane, seen with r to the right. A solid's first and last rows are closed by
/// flat fans; a ring's last row joins its first.
struct Turned {
  std::uint32_t sides, rows;
  bool is_ring;
  std::function<ProfilePoint(std::uint32_t row, double theta)> profile;
};
[[nodiscard]] geometry::TriangleMesh turned_mesh(const Turned&);

/// Axis z, from -height / 2 to height / 2.
[[nodiscard]] geometry::TriangleMesh cylinder_mesh(double radius_m, double height_m, std::uint32_t sides);
[[nodiscard]] geometry::TriangleMesh tube_mesh(double inner_m, double outer_m, double height_m, std::uint32_t sides);
/// Tip at the origin, opening towards +z.
[[nodiscard]] geometry::TriangleMesh cone_mesh(double half_angle_rad, double height_m, std::uint32_t sides);

/// Round the z axis, with slivers at its poles: as drawing programs make a sphere. Its bumps are as wide as a tenth of
/// its radius, and bump_m high at most.
struct BumpyBall {
  double radius_m, bump_m;
  std::uint32_t sides, rows;
};
[[nodiscard]] geometry::TriangleMesh bumpy_ball_mesh(const BumpyBall&);

/// A single-start thread of triangular profile: radius between radius_m and radius_m + depth_m.
struct Thread {
  double radius_m = 0.01, depth_m = 1.5e-3, pitch_m = 4e-3;
  std::uint32_t turns = 4, sides = 24, steps = 4;  ///< steps: rows for each pitch
};
[[nodiscard]] geometry::TriangleMesh bolt_mesh(const Thread&);
/// The nut that a bolt fits with this clearance along the radius.
[[nodiscard]] geometry::TriangleMesh nut_mesh(const Thread&, double clearance_m, std::uint32_t turns);

/// Axis z; teeth of triangular profile between radius_m and radius_m + depth_m.
[[nodiscard]] geometry::TriangleMesh spur_mesh(std::uint32_t teeth, double radius_m, double depth_m, double height_m);

}  // namespace farfeel::support
