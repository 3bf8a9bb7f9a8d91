// What `farfeel-bench touch` touches: the benchmark models, scans from a folder, and generated solids that are hard to
// feel: shells, thin walls, narrow gaps, sharp tips. Every mesh is closed and oriented, in metres.
#pragma once

#include <filesystem>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "slave_sim/bake/bake.h"

namespace farfeel::bench {

struct TouchModel {
  std::string name;
  geometry::TriangleMesh (*generated)(double size_mm) = nullptr;  ///< with size_mm; else
  double size_mm = 0;                                             ///< what the generator varies, mostly the wall
  std::string benchmark{};                                        ///< one of slave_sim/models; else
  std::filesystem::path scan{};                                   ///< an .obj file, scaled to kScanDiagonal_m
};

inline constexpr double kScanDiagonal_m = 0.25;

/// All of them, in the order in which they are reported. Scans are named whether or not `scans` holds their files.
[[nodiscard]] std::vector<TouchModel> touch_models(const std::filesystem::path& scans);

/// The mesh in its own frame, and how it is baked unless somebody says otherwise; or why it cannot be had.
struct TouchMesh {
  geometry::TriangleMesh mesh;
  slave_sim::BakeOptions options;
};
[[nodiscard]] tl::expected<TouchMesh, std::string> touch_mesh(const TouchModel&);

// Solids of the list above, for other benchmarks too. Surfaces of revolution have 96 sides and the axis z.
/// Half a sphere of 60 mm radius, open upwards, its rim at z = 0.
[[nodiscard]] geometry::TriangleMesh bowl_mesh(double wall_mm);
/// 80 x 50 mm, bent and waved, its middle near the origin.
[[nodiscard]] geometry::TriangleMesh leaf_mesh(double wall_mm);
/// A ball of this diameter, 20,480 triangles; and its base of 320.
[[nodiscard]] geometry::TriangleMesh ball_mesh(double diameter_mm);
[[nodiscard]] geometry::TriangleMesh ball_base(double diameter_mm);
/// A round bar with half balls for ends, along z.
[[nodiscard]] geometry::TriangleMesh capsule_mesh(double diameter_mm, double length_mm);

}  // namespace farfeel::bench
