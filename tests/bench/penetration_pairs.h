// Pairs of textured plates for the penetration benchmark, as closed forms, as felt surfaces and as full meshes.
#pragma once

#include <string>
#include <vector>

#include "haptic_core/penetration/back_end.h"
#include "tests/support/plate_patterns.h"

namespace farfeel::bench {

using support::HeightFunction;

/// S lies in C's x-y plane facing up, T above it facing down. Both are 40 mm wide with 1024 x 1024 texels; T bulges
/// with a radius of 60 mm, as the gear does.
class PlatePair {
 public:
  PlatePair(std::string name, HeightFunction s, HeightFunction t);
  PlatePair(const PlatePair&) = delete;
  PlatePair& operator=(const PlatePair&) = delete;

  /// T turned over, turned about z by turn_rad, tilted, and moved.
  [[nodiscard]] static spatial::Pose tool_pose(double turn_rad, const glm::dvec2& tilt_rad, const glm::dvec3& p_CT);
  [[nodiscard]] penetration::Query query(const spatial::Pose& X_CT, double soft_width_m, std::uint32_t samples) const;
  void prepare(penetration::BackEnd& back_end) const { back_end.prepare(s_), back_end.prepare(t_); }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const HeightFunction& s_height() const { return s_height_; }
  [[nodiscard]] const HeightFunction& t_height() const { return t_height_; }

 private:
  std::string name_;
  HeightFunction s_height_, t_height_;
  geometry::HapticSurface s_surface_, t_surface_;
  penetration::FeltSurface s_, t_;
  std::vector<std::uint32_t> triangles_{0, 1};
};

inline constexpr double kPlateWidth_m = 0.04;
inline constexpr penetration::Window kPlateWindow{{-0.01, -0.01}, {0.01, 0.01}};

/// "ridged": crossed ridges of 3.7 and 4.2 mm, 0.3 mm deep; "rough": wavelengths of 0.35 to 1.6 mm on both; "scan": one
/// surface with all wavelengths from 0.2 to 8 mm, the longer the higher, under a probe of 3 mm radius.
[[nodiscard]] std::unique_ptr<PlatePair> plate_pair(const std::string& name);

}  // namespace farfeel::bench
