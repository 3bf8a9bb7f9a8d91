// The surfaces that the loop is measured on, and where the tool is along a stroke over each.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "tests/bench/felt_pair.h"

namespace farfeel::bench {

/// Without friction: the depth's own force is what rungs are compared by.
inline constexpr contact::Material kWithoutLoss{.damping_Ns_per_m = 0, .static_friction = 0, .dynamic_friction = 0};
/// The same with the default damping, for what must come to rest.
inline constexpr contact::Material kDamped{.static_friction = 0, .dynamic_friction = 0};

class StrokedScene : public FeltPair {
 public:
  /// tool_radius_m: from the tool's origin to the face that works. object_radius_m: of the surface's own curve along
  /// the stroke; 0: flat.
  StrokedScene(std::string name, geometry::HapticSurface object, geometry::HapticSurface tool, const glm::dquat& R_WT,
               double tool_radius_m, double object_radius_m = 0, const spatial::Pose& X_WO = {});

  /// The tool along_m on its stroke, across_m beside it, turned about the surface's direction, pressed in by press_m.
  [[nodiscard]] spatial::Pose X_WT(double along_m, double across_m, double turn_rad, double press_m) const;
  /// Out of the surface, there.
  [[nodiscard]] glm::dvec3 nhat_W(double along_m) const;
  /// The tool as it faces the surface.
  [[nodiscard]] const glm::dquat& R_WT() const { return R_WT_; }

 private:
  glm::dquat R_WT_;
  double tool_radius_m_, object_radius_m_;
};

enum class SceneChoice { kOne, kAll };
/// ridges: 1.5 mm pitch, 0.1 mm high, under a curved plate of 6 x 5 mm. roughness: waves of 1.2 to 4 mm every way,
/// about 40 um rms, under the same plate. scan: a dome of 80 mm radius with relief of 1 to 8 mm, 60 um rms, baked from
/// 92,000 triangles into flat pieces with charts, under a probe of 6 mm diameter.
[[nodiscard]] std::vector<std::unique_ptr<StrokedScene>> stroked_scenes(SceneChoice);

}  // namespace farfeel::bench
