// The soft depth of two textured plates by plain quadrature in double precision: the textures' splines are evaluated
// here, from their coefficients, and no code of the penetration library takes part.
#pragma once

#include <vector>

#include "haptic_core/geometry/haptic_surface.h"

namespace farfeel::support {

/// Of S, which faces up, and T, which faces down. Both are plates of plates.h.
class PlateTruth {
 public:
  PlateTruth(const geometry::HapticSurface& s, const geometry::HapticSurface& t);

  /// The greatest overlap of the heights as they are [m], among nodes 20 um apart.
  [[nodiscard]] double hard_depth_m(const spatial::Pose& X_ST) const;

  struct Soft {
    double depth_m;
    glm::dvec3 gradient_S;  ///< d depth / d translation of T, along S's axes
  };
  /// w ln(integral exp(overlap / w) keep du dv / a0): nodes are a third of a sharp spike's width apart, cells of 40 um
  /// that lie 15 widths below the peak are left out. keep: the fade along the plates' edges.
  [[nodiscard]] Soft soft(const spatial::Pose& X_ST, double soft_width_m) const;

 private:
  /// A plate's heights above its own plane, as a quadratic B-spline.
  struct Field {
    explicit Field(const geometry::HapticSurface&);
    /// Height and its slopes along x and y; x and y within the plate.
    [[nodiscard]] glm::dvec3 at(double x, double y) const;

    std::vector<double> coefficients_m;
    std::size_t columns, rows;  ///< of texels; coefficients have one more on each side
    glm::dvec2 low;             ///< corner of the chart
    double texel_m;
    glm::dvec2 half_m;  ///< of the plate
  };
  struct Node;
  /// Rows of nodes over the part of S's plane that both plates are over.
  struct Places {
    glm::dvec2 low, high;
  };
  [[nodiscard]] Places places(const spatial::Pose& X_ST) const;
  /// False where one of them is not.
  bool overlap_at(const spatial::Pose& X_ST, const glm::dvec2& uv, Node& node) const;

  Field s_, t_;
};

}  // namespace farfeel::support
