// Closed quad skins of box-shaped cells: the topology that most benchmark models are bent from.
//
// Cuts divide the three axes into intervals, `is_solid` says which cells are filled, and each interval is divided into
// equal steps. The skin is what separates filled from empty, two triangles a step square, and every skin vertex is
// placed by the caller's closed form. It is closed and oriented as long as no two filled cells touch along an edge or
// at a corner only.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

struct LatticeSolid {
  std::array<std::vector<double>, 3> cuts_m;          ///< ascending, per axis
  std::array<std::vector<std::uint32_t>, 3> steps;    ///< >= 1, one for each interval between cuts
  std::function<bool(int i, int j, int k)> is_solid;  ///< of cell (i, j, k), in range
};

/// A vertex of the skin before it is placed.
struct LatticePoint {
  glm::dvec3 p;  ///< on the unbent lattice [m]
  std::array<std::array<bool, 2>, 3>
      faces{};  ///< [axis][0 low, 1 high]: the outward directions of the skin's squares around it

  [[nodiscard]] bool is_on(int axis, int side) const { return faces[axis][side]; }
  /// Sum of the outward unit directions around the point, each counted once: moving by h times it moves every face
  /// around the point outwards by h, edges and corners included.
  [[nodiscard]] glm::dvec3 outward() const;
};

[[nodiscard]] geometry::TriangleMesh skin(const LatticeSolid&,
                                          const std::function<glm::dvec3(const LatticePoint&)>& place);

}  // namespace farfeel::slave_sim
