// A tool's displaced surface as points, each standing for an equal part of its coarse triangle.
//
// A triangle is halved across its longest side until its parts are about as large as a point may be; the parts of a
// part follow each other, so that a part of any level is a run of points.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/contact/depth/points/faceted_surface.h"

namespace farfeel::contact {

/// A triangle's part's parts, on either side of a line from the middle of its longest side.
[[nodiscard]] std::array<std::array<glm::dvec3, 3>, 2> halves(const std::array<glm::dvec3, 3>& corners) noexcept;

/// One thread at a time. Refers to the surface, which outlives it.
class SurfacePoints {
 public:
  explicit SurfacePoints(const FacetedSurface&);

  [[nodiscard]] const FacetedSurface& surface() const { return *surface_; }
  [[nodiscard]] std::uint32_t levels(std::uint32_t triangle) const { return levels_[triangle]; }
  [[nodiscard]] std::uint32_t first(std::uint32_t triangle) const { return first_[triangle]; }
  [[nodiscard]] std::uint32_t count(std::uint32_t triangle) const { return 1u << levels_[triangle]; }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(points_O_.size()); }

  /// Of what a point stands for.
  [[nodiscard]] double mean_area_m2() const { return mean_area_m2_; }
  /// How far points are from the middle of the four of which they are one; few may be farther.
  [[nodiscard]] double usual_aside_m() const { return usual_aside_m_; }
  /// The triangle's points as its heights are now. The first time, and after an edit, they are looked up.
  /// Realtime-safe.
  [[nodiscard]] std::span<const glm::dvec3> of(std::uint32_t triangle) noexcept;

 private:
  const FacetedSurface* surface_;
  std::vector<std::uint32_t> levels_, first_;  // of each triangle
  std::vector<std::uint64_t> seen_;            // of each: FeltSurface::changes() when it was looked up, and one
  std::vector<glm::dvec3> points_O_;
  double mean_area_m2_ = 1, usual_aside_m_ = 0;
};

}  // namespace farfeel::contact
