// Points of a mesh, spread evenly over its area; the same ones for the same seed.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

class SurfacePoints {
 public:
  /// The mesh has a triangle, and outlives this.
  SurfacePoints(const geometry::TriangleMesh& mesh, std::uint64_t seed);
  struct Point {
    glm::dvec3 p_O, nhat_O;  ///< the normal is that of its triangle
  };
  [[nodiscard]] Point next();

 private:
  const geometry::TriangleMesh& mesh_;
  std::vector<double> area_up_to_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> unit_{0, 1};
};

}  // namespace farfeel::slave_sim
