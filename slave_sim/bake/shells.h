// The connected parts of a surface: which triangles they have, and which way they face.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "slave_sim/bake/found.h"
#include "slave_sim/bake/mesh_edges.h"

namespace farfeel::slave_sim {

struct Shells {
  std::vector<std::uint32_t> of_triangle;
  std::uint32_t count = 0;
  Found turned;               ///< triangles turned to agree with most of their shell
  bool has_one_side = false;  ///< some shell cannot be oriented
};

/// Connected across edges with two triangles; every shell oriented as most of its triangles are.
[[nodiscard]] Shells orient(geometry::TriangleMesh&, const Edges&);

struct Facing {
  Found outwards, inwards;   ///< shells turned as a whole
  std::size_t cavities = 0;  ///< shells that face inwards now
};

/// Turns shells so that one within an even number of others faces outwards, and one within an odd number inwards: it is
/// a cavity. Shells that pass through each other do not lie within each other. Precondition: closed shells, as orient()
/// left them.
[[nodiscard]] Facing face_by_depth(geometry::TriangleMesh&, const Shells&);

}  // namespace farfeel::slave_sim
