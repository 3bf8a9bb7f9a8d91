// What a mesh costs without any of ours: simplified, its coordinates rounded to a grid, coded by Draco.
#pragma once

#include <cstddef>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::bench {

struct PlainDraco {
  std::size_t bytes = 0;  ///< 0: no such mesh is as near
  std::size_t triangles = 0;
  int bits = 0;  ///< of a coordinate
  double rms_m = 0;
};

/// Of those that are at most rms_m from the mesh, either way, one of the smallest: the fewest triangles that take two
/// thirds of the error's square, then the fewest bits. Precondition: closed and oriented.
[[nodiscard]] PlainDraco plain_draco(const geometry::TriangleMesh& full, double rms_m);

}  // namespace farfeel::bench
