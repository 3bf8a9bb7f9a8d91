// Nodes of one square lattice in cells of another, whatever the ratio of their steps. An origin holds both: cell I of a
// side goes from I to I + 1 times its width, node i stands at i + 1/2 steps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "haptic_core/penetration/back_end.h"
#include "haptic_core/penetration/simd_kernels.h"

namespace farfeel::penetration {

struct Lattices {
  glm::dvec2 origin_m;
  double cell_m, step_m;
  Window
      window;  ///< where it cuts through a cell, nodes beyond that cell which stand for some of the window belong to it
};

/// Writes the nodes that lie in the chosen cells, row by row, with the heights that the cells' slopes tell. Every node
/// lies in one cell. Returns their number; or, where they are more than `most`, something greater, and nodes hold
/// nothing of use. nodes needs room for `most` and a vector more.
[[nodiscard]] std::size_t lay(const Lattices&, const simd::LaneCells& cells, std::span<const std::uint32_t> chosen,
                              std::size_t most, const simd::LaneCells& nodes) noexcept;

}  // namespace farfeel::penetration
