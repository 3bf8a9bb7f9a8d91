// Meshes as people bring them: shapes that simplify badly, and faults that are mended or refused. Each with what a bake
// is to make of it. In metres, some centimetres across.
#pragma once

#include <span>
#include <string_view>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::support {

struct BadMesh {
  std::string_view name;
  bool is_baked;  ///< or else refused, with a reason
  geometry::TriangleMesh (*make)();
  std::string_view words;  ///< part of what is told, of what was mended, doubted or refused; empty: nothing is
  double volume_m3 = 0;    ///< of what it is mended to; 0: in no closed form
  bool is_large = false;   ///< tens of thousands of triangles or more
  bool is_huge = false;    ///< more than half a million
};

[[nodiscard]] std::span<const BadMesh> bad_meshes();

}  // namespace farfeel::support
