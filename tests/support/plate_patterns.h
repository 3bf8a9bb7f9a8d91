// Pairs of plates with the textures that depths are hard to sum over: saws, knurls, spikes, grain, and milder ones.
#pragma once

#include <functional>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "haptic_core/penetration/back_end.h"
#include "tests/support/plates.h"

namespace farfeel::support {

using HeightFunction = std::function<double(double, double)>;  ///< [m] of [m]

/// Waves across the direction at turn_rad, from 0 down to -depth_m.
[[nodiscard]] HeightFunction ridges(double period_m, double depth_m, double turn_rad);
/// A sum of 40 waves of random direction and phase, their lengths spread evenly on a logarithmic scale, each as high as
/// its length to the power of `growth`.
[[nodiscard]] HeightFunction roughness(double shortest_m, double longest_m, double rms_m, double growth, unsigned seed);
/// The cap of a ball below a height.
[[nodiscard]] HeightFunction with_bulge(const HeightFunction& height, double radius_m);

/// A plate S that faces up and a tool T that faces down, each of one piece.
class PlatePattern {
 public:
  PlatePattern(geometry::HapticSurface s, geometry::HapticSurface t, double most_turn_rad, double most_tilt_rad);
  PlatePattern(const PlatePattern&) = delete;
  PlatePattern& operator=(const PlatePattern&) = delete;

  /// T somewhere above S's middle, turned and tilted by as much as this pattern bears; To is in S's plane.
  [[nodiscard]] spatial::Pose random_pose(std::mt19937& random) const;
  /// X_CS: S in the contact frame; its z axis is C's.
  [[nodiscard]] penetration::Query query(const spatial::Pose& X_CS, const spatial::Pose& X_ST, double soft_width_m,
                                         std::uint32_t samples) const;
  [[nodiscard]] const geometry::HapticSurface& s() const { return s_surface_; }
  [[nodiscard]] const geometry::HapticSurface& t() const { return t_surface_; }
  void prepare(penetration::BackEnd& back_end) const { back_end.prepare(s_), back_end.prepare(t_); }

 private:
  geometry::HapticSurface s_surface_, t_surface_;
  penetration::FeltSurface s_, t_;
  std::vector<std::uint32_t> triangles_{0, 1};
  double most_turn_rad_, most_tilt_rad_;
};

/// What plate_pattern() knows.
[[nodiscard]] const std::vector<std::string>& plate_pattern_names();
/// Throws std::invalid_argument for a name that is none of them.
[[nodiscard]] std::unique_ptr<PlatePattern> plate_pattern(std::string_view name);

}  // namespace farfeel::support
