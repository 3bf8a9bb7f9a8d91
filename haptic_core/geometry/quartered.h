// A mesh with each triangle in four.
#pragma once

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::geometry {

/// Divided at its sides' middles, which neighbours share: the same surface. The vertices come first, as they were, then
/// the middles.
[[nodiscard]] TriangleMesh quartered(const TriangleMesh&);

}  // namespace farfeel::geometry
