// The surface that is felt: a coarse mesh in convex surface pieces, and over it a height field for each planar chart.
//
// The coarse mesh says where contacts are (proximity between pieces); the charts say what they feel like. A chart is a
// plane H beside a patch of the coarse mesh, and the displaced surface over the patch is
//   p_H(s, t) = (s, t, h(s, t)),
// with h measured from the chart's *plane* along its z axis, not from the coarse triangles: h stays smooth where the
// coarse mesh has edges, and neighbouring charts, each baked some texels beyond its own patch, describe the same
// surface where they meet. h is a C1 uniform quadratic B-spline whose coefficients are stored in tiles; see
// height_tile.h. Source: the haptic textures of Otaduy, Jain, Sud and Lin 2004, section 4, with the plane in place of
// the coarse face.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "haptic_core/geometry/height_tile.h"
#include "haptic_core/geometry/triangle_mesh.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::geometry {

inline constexpr std::uint32_t kNoChart = 0xFFFF'FFFF;  ///< the chart of a triangle that carries no texture

/// One planar chart. Texel (i, j) is centred at ((i + 1/2) texel_m, (j + 1/2) texel_m) in H's x-y plane, and covers one
/// texel_m squared; 0 <= i < columns, 0 <= j < rows. Its tiles stand row by row from first_tile.
struct Chart {
  spatial::Pose X_OH;           ///< z axis: the chart's outward direction
  double texel_m;               ///< > 0
  std::uint32_t columns, rows;  ///< >= 1
  std::uint32_t first_tile;     ///< index into HapticSurface::tiles

  [[nodiscard]] std::uint32_t tiles_across() const { return (columns + kTileTexels - 1) / kTileTexels; }
  [[nodiscard]] std::uint32_t tiles_down() const { return (rows + kTileTexels - 1) / kTileTexels; }
};

/// Height of the displaced surface over a chart's plane, with its first and second derivatives.
struct HeightSample {
  double h_m;
  double h_s, h_t;  ///< slopes dh/ds, dh/dt [1]
  double h_ss_1_per_m, h_st_1_per_m, h_tt_1_per_m;
};

struct HapticSurface {
  TriangleMesh coarse;                        ///< positions are exactly representable in float
  std::vector<std::uint32_t> triangle_piece;  ///< per coarse triangle: its convex surface piece, < piece_count
  std::vector<std::uint32_t> triangle_chart;  ///< per coarse triangle: its chart, or kNoChart
  std::uint32_t piece_count = 0;
  /// Per piece: the material behind it, see piece_thickness.h [m]; 0: unknown. Empty: not measured yet.
  std::vector<double> piece_thickness_m;
  std::vector<Chart> charts;
  std::vector<HeightTile> tiles;
  HeightScale scale;  ///< metres for every tile's coefficients

  [[nodiscard]] bool is_textured() const { return !charts.empty(); }
};

/// The height field at (s, t) [m] in the chart's plane. Outside the chart's rectangle the nearest border texel's
/// polynomial is not extrapolated: (s, t) is clamped to the rectangle first. Realtime-safe; cannot fail.
[[nodiscard]] HeightSample sample_height(const HapticSurface&, const Chart&, double s_m, double t_m) noexcept;

/// Sizes agree, indices are in range, coordinates are finite, no piece is thicker than the whole, charts' poses are
/// valid and tiles present. Empty when all is well, else what is wrong.
[[nodiscard]] std::vector<std::string> faults(const HapticSurface&);

}  // namespace farfeel::geometry
