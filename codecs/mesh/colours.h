// Colours of vertices, meshes that have them, and which vertex is nearest to a place.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::codecs {

using Colour = std::array<std::uint8_t, 3>;  ///< red, green and blue as screens take them (sRGB)

struct ColouredMesh : geometry::TriangleMesh {
  std::vector<Colour> colours;  ///< one a vertex, or none
};

/// Light, in [0, 1], of one of a colour's three, and back; what is out of range, or not a number, is brought into it.
[[nodiscard]] double light_of(std::uint8_t on_screen);
[[nodiscard]] std::uint8_t on_screen(double light);

/// Finds the nearest of many points; those that are not finite are left out.
class NearestPoint {
 public:
  /// The points must outlive it.
  explicit NearestPoint(std::span<const glm::dvec3> points);
  [[nodiscard]] bool is_empty() const { return order_.empty(); }
  /// Index of the point. Precondition: not empty; finite.
  [[nodiscard]] std::uint32_t to(const glm::dvec3& place) const;

 private:
  void sort(std::size_t first, std::size_t end, int axis);
  void look(std::size_t first, std::size_t end, int axis, const glm::dvec3& place, std::uint32_t& best,
            double& best_m2) const;

  std::span<const glm::dvec3> points_;
  std::vector<std::uint32_t> order_;  // a tree: the middle of a range parts it, by x, y, z in turn
};

}  // namespace farfeel::codecs
