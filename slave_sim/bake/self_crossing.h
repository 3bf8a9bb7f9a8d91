// Does a surface pass through itself?
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

struct SelfCrossing {
  std::size_t edges = 0;   ///< that were found to pierce a triangle
  std::size_t looked = 0;  ///< edges that were looked at: all, or evenly spread over a mesh with more than the budget
  std::size_t of = 0;      ///< all edges
  glm::dvec3 first_O{0};   ///< where the first of them does
};

/// Edges that pierce a triangle they share no vertex with, further than 1e-6 of the mesh's size to either side:
/// touching is not crossing. Looks at `most_edges` at most, some seconds' worth. Precondition: finite, indices in
/// range.
[[nodiscard]] SelfCrossing self_crossing(const geometry::TriangleMesh&, std::size_t most_edges = 2'000'000);

/// For a person: how many, where, what it means and what to do; none if nothing crosses.
[[nodiscard]] std::optional<std::string> words_about(const SelfCrossing&);

}  // namespace farfeel::slave_sim
