// The connected parts of a surface: which triangles they have, and which way they face.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "slave_sim/bake/mesh_edges.h"

namespace farfeel::slave_sim {

struct Shells {
  std::vector<std::uint32_t> of_triangle;
  std::uint32_t count = 0;
  std::size_t turned = 0;     ///< triangles turned to agree with most of their shell
  glm::dvec3 first_O{0};      ///< where the first of them is
  bool has_one_side = false;  ///< some shell cannot be oriented
};

/// Connected across edges with two triangles; every shell oriented as most of its triangles are.
[[nodiscard]] Shells orient(geometry::TriangleMesh&, const Edges&);

/// Shells turned as a whole.
struct Facing {
  std::size_t outwards = 0, inwards = 0;
  glm::dvec3 first_outwards_O{0}, first_inwards_O{0};
};

/// Turns shells so that one within an even number of others faces outwards, and one within an odd number inwards: it is
/// a cavity. Shells that pass through each other do not lie within each other. Precondition: closed shells, as orient()
/// left them.
[[nodiscard]] Facing face_by_depth(geometry::TriangleMesh&, const Shells&);

}  // namespace farfeel::slave_sim
