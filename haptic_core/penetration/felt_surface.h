// A haptic surface made ready for penetration queries: what can be known once, before anything moves.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/geometry/haptic_surface.h"
#include "haptic_core/penetration/height_bounds.h"

namespace farfeel::penetration {

inline constexpr std::uint32_t kNoTriangle = 0xFFFF'FFFF;

/// Least and greatest height of the felt surface over a coarse triangle, along its chart's outward direction [m].
struct Relief {
  double low_m = 0, high_m = 0;
};

/// What can be known of heights without having them.
struct HeightLimits {
  std::vector<Relief> reliefs;             ///< one a coarse triangle
  std::vector<double> most_bends_1_per_m;  ///< one a chart
};

/// A chart's spline coefficients without the tiles' repeated borders, row by row: texel (i, j)'s three by three start
/// at heights[j * stride + i]. Four entries beyond the last may be read.
struct PackedHeights {
  const std::uint16_t* heights = nullptr;
  std::uint32_t stride = 0;
};

/// Refers to the surface it was made from, which must outlive it and keep its place. Any thread may read, but for
/// the time of a take_tile().
class FeltSurface {
 public:
  explicit FeltSurface(const geometry::HapticSurface&);
  /// Where heights come later, by take_tile().
  FeltSurface(const geometry::HapticSurface&, HeightLimits);

  /// The surface's tile has changed: follows it in everything that is known from heights. Their limits, which whoever
  /// made the surface knows for its first version, are only widened, and only by a newer one. Realtime-safe.
  /// Precondition: tile < haptic().tiles.size().
  void take_tile(std::uint32_t tile) noexcept;

  /// How often tiles were taken so far, and of each tile at which of these times it was last; 0: never.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }
  [[nodiscard]] std::span<const std::uint64_t> tile_changes() const { return tile_changes_; }
  /// The chart that a tile belongs to, and where its coefficients stand among the chart's packed ones.
  struct TilePlace {
    std::uint32_t chart = 0, first_column = 0, first_row = 0, columns = 0, rows = 0;
  };
  [[nodiscard]] TilePlace place_of(std::uint32_t tile) const noexcept;

  [[nodiscard]] const geometry::HapticSurface& haptic() const { return *surface_; }
  [[nodiscard]] std::span<const std::uint32_t> triangles_of_piece(std::uint32_t piece) const;
  /// The triangles across edges (0,1), (1,2), (2,0); kNoTriangle where the mesh is open.
  [[nodiscard]] const std::array<std::uint32_t, 3>& neighbours(std::uint32_t triangle) const {
    return neighbours_[triangle];
  }
  [[nodiscard]] const glm::dvec3& unit_normal_O(std::uint32_t triangle) const { return normals_O_[triangle]; }
  [[nodiscard]] const Relief& relief(std::uint32_t triangle) const { return limits_.reliefs[triangle]; }
  [[nodiscard]] const glm::dvec3& chart_axis_O(std::uint32_t chart) const { return axes_O_[chart]; }
  [[nodiscard]] const HeightBounds& bounds(std::uint32_t chart) const { return bounds_[chart]; }
  /// Nowhere on the chart the surface bends upwards more.
  [[nodiscard]] double most_bend_1_per_m(std::uint32_t chart) const { return limits_.most_bends_1_per_m[chart]; }
  /// Nor is its texture steeper, against the chart's plane. Of the heights that are at hand.
  [[nodiscard]] double most_slope(std::uint32_t chart) const { return most_slopes_[chart]; }
  [[nodiscard]] const HeightLimits& limits() const { return limits_; }
  [[nodiscard]] PackedHeights packed(std::uint32_t chart) const {
    return {packed_.data() + packed_start_[chart], haptic().charts[chart].columns + 2};
  }

 private:
  /// Copies a tile's coefficients, and sees how steep they are.
  void pack(std::uint32_t tile) noexcept;
  void widen_limits(std::uint32_t tile) noexcept;

  const geometry::HapticSurface* surface_;
  std::vector<std::uint32_t> piece_start_, piece_triangles_;  // triangles of piece p: [piece_start_[p], [p + 1])
  std::vector<std::array<std::uint32_t, 3>> neighbours_;
  std::vector<glm::dvec3> normals_O_;
  HeightLimits limits_;
  std::vector<glm::dvec3> axes_O_;   // of charts
  std::vector<double> most_slopes_;  // of charts
  std::vector<std::uint16_t> packed_;
  std::vector<std::size_t> packed_start_;
  std::vector<HeightBounds> bounds_;
  std::vector<std::uint32_t> tile_chart_;  // the chart that a tile belongs to
  std::vector<std::uint64_t> tile_changes_;
  std::uint64_t changes_ = 0;
};

}  // namespace farfeel::penetration
