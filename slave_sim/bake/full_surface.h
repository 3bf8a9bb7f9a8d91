// The full mesh as rays and nearest-point queries see it (Embree).
#pragma once

#include <memory>
#include <optional>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::slave_sim {

/// Queries are safe from several threads at once. Throws std::bad_alloc where memory ends.
class FullSurface {
 public:
  explicit FullSurface(const geometry::TriangleMesh& mesh);
  ~FullSurface();
  FullSurface(const FullSurface&) = delete;
  FullSurface& operator=(const FullSurface&) = delete;

  /// Along the line p_O + z d_O, |z| <= reach_m: the z nearest to zero where the surface faces along +d_O, its outward
  /// normal within 75 degrees of it. Empty if there is none. Precondition: |d_O| = 1.
  [[nodiscard]] std::optional<double> height_along(const glm::dvec3& p_O, const glm::dvec3& d_O, double reach_m) const;
  /// From p_O along d_O to the first place where the surface is left through a side whose normal has a cosine of
  /// least_facing to d_O: with that of 20 degrees how thick a sheet is, with 0 any thing. Empty if it is not left so.
  /// Precondition: |d_O| = 1.
  [[nodiscard]] std::optional<double> thickness_m(const glm::dvec3& p_O, const glm::dvec3& d_O,
                                                  double least_facing = kSheet) const;
  static constexpr double kSheet = 0.94;  ///< what faces less squarely is a wedge
  struct Nearest {
    double distance_m;
    glm::dvec3 nhat_O;  ///< outward, of the triangle that holds the nearest point
  };
  [[nodiscard]] Nearest nearest(const glm::dvec3& p_O) const;
  /// Distance to the nearest point of the surface [m].
  [[nodiscard]] double distance_m(const glm::dvec3& p_O) const { return nearest(p_O).distance_m; }

 private:
  struct Scene;
  const geometry::TriangleMesh& mesh_;
  std::unique_ptr<Scene> scene_;
};

}  // namespace farfeel::slave_sim
