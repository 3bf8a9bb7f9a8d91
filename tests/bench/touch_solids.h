// The generated solids of touch_models.h, each by the one length that the list varies.
#pragma once

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::bench {

[[nodiscard]] geometry::TriangleMesh dish_mesh(double wall_mm);       ///< of a sphere of 120 mm radius, 155 mm across
[[nodiscard]] geometry::TriangleMesh cup_mesh(double wall_mm);        ///< 70 mm across and high
[[nodiscard]] geometry::TriangleMesh lens_mesh(double thickness_mm);  ///< 60 mm across, its rim sharp
[[nodiscard]] geometry::TriangleMesh tray_mesh(double wall_mm);       ///< 120 x 80 x 20 mm, open upwards
[[nodiscard]] geometry::TriangleMesh tube_mesh(double wall_mm);       ///< 20 mm across, 60 mm long
[[nodiscard]] geometry::TriangleMesh fins_mesh(double wall_mm);       ///< eight, 15 mm high, 4.5 mm apart
[[nodiscard]] geometry::TriangleMesh bolt_solid(double pitch_mm);     ///< of 20 mm, thread 1.5 mm deep
[[nodiscard]] geometry::TriangleMesh nut_solid(double pitch_mm);      ///< for it
[[nodiscard]] geometry::TriangleMesh knurl_mesh(double pitch_mm);     ///< diamonds 0.3 mm high, on a bar of 30 mm
[[nodiscard]] geometry::TriangleMesh saw_mesh(double pitch_mm);       ///< teeth a fifth of the pitch high, on a plate
[[nodiscard]] geometry::TriangleMesh spikes_mesh(double high_mm);     ///< cones 2.4 mm across, 4 mm apart, on a plate
[[nodiscard]] geometry::TriangleMesh sponge_mesh(double strut_mm);    ///< bent square struts, gaps as wide as they
[[nodiscard]] geometry::TriangleMesh wall_mesh(double wall_mm);       ///< 60 x 60 mm, bent about 150 mm

}  // namespace farfeel::bench
