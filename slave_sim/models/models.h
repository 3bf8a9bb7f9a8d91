// The benchmark's models: procedural, closed-form surfaces at the source's full-resolution triangle counts
// (Otaduy & Lin 2006, Table 6; its own meshes are not public), and a probe to feel other things with.
//
// Every mesh is closed and oriented, in metres, in a frame O at the middle of its bounding dimensions.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "haptic_core/contact/material.h"
#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

struct Model {
  std::string_view name;
  std::uint32_t full_triangles;    ///< exactly what full_mesh() has
  std::uint32_t coarse_triangles;  ///< what a bake should aim for
  std::uint32_t source_pieces;  ///< convex surface pieces of the source's model, to stand beside ours; the probe's is 1
  double density_kg_per_m3;
  contact::Material material;
  geometry::TriangleMesh (*full_mesh)();
  /// The shape without its felt features, coarse; null where only a simplification of the full mesh will do.
  geometry::TriangleMesh (*base_mesh)();
};

[[nodiscard]] std::span<const Model> models();
[[nodiscard]] const Model* find_model(std::string_view name);  ///< null if there is none of that name

/// 80 x 80 x 40 mm. Rounded ridges along y on the two large faces: crests and valleys of depth 1.5 mm, period 6 mm
/// along x, a crest at x = 0.
[[nodiscard]] geometry::TriangleMesh block_mesh();
[[nodiscard]] geometry::TriangleMesh block_base();  ///< a box through the ridges, 16 triangles
/// Axis z, diameter 120 mm, width 30 mm. 60 rounded axial ridges of depth 1.5 mm round the rim, a crest at +x.
[[nodiscard]] geometry::TriangleMesh gear_mesh();
[[nodiscard]] geometry::TriangleMesh gear_base();  ///< a prism of 400 sides through the ridges, 1,600 triangles
/// 200 x 25 x 6 mm along x, y, z; tapered and bellied towards +x. Crossed ridges at +-45 degrees on both large faces,
/// period 1.5 mm, depth 0.3 mm; a single cut of the same period on the narrow ones.
[[nodiscard]] geometry::TriangleMesh file_mesh();
/// 160 x 120 x 60 mm plate with two round bosses, two round through holes, a pocket with an island, a step, a rib and
/// a notch; roughness of 2-6 mm wavelength, 0.15 mm rms, on every face.
[[nodiscard]] geometry::TriangleMesh cad_part_mesh();

/// 300 mm along x, a head of 110 mm along y at its low end; round sections, bumps of 2-6 mm, 0.15 mm rms (crests of
/// about 0.3 mm).
[[nodiscard]] geometry::TriangleMesh hammer_mesh();
/// Axis z, radii 60 and 20 mm, wrinkles of amplitude 0.6 mm and period 5 mm that wind round the tube three times a
/// turn.
[[nodiscard]] geometry::TriangleMesh helicoidal_torus_mesh();
/// A smooth sphere of 6 mm diameter.
[[nodiscard]] geometry::TriangleMesh probe_mesh();
[[nodiscard]] geometry::TriangleMesh probe_base();  ///< 320 triangles with the sphere's volume

}  // namespace farfeel::slave_sim
