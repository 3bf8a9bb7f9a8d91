// Undirected edges of a mesh that may be anything, and the triangles that have them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// The lesser corner in the upper half.
[[nodiscard]] inline std::uint64_t edge_key(std::uint64_t a, std::uint64_t b) {
  return std::min(a, b) << 32 | std::max(a, b);
}

using Edges = std::unordered_map<std::uint64_t, std::vector<std::uint32_t>>;

[[nodiscard]] inline Edges edges_of(const geometry::TriangleMesh& mesh) {
  Edges edges;
  edges.reserve(mesh.triangles.size() * 2);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      edges[edge_key(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3])].push_back(i);
  }
  return edges;
}

/// Does the triangle run along the edge in that direction?
[[nodiscard]] inline bool runs(const geometry::Triangle& t, std::uint32_t from, std::uint32_t to) {
  return (t[0] == from && t[1] == to) || (t[1] == from && t[2] == to) || (t[2] == from && t[0] == to);
}

}  // namespace farfeel::slave_sim
