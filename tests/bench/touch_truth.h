// How deep a ball or a capsule really is in a mesh, and which way is out: the judge of `farfeel-bench touch`. It knows
// triangles only, and shares no code with what it judges. Embree names candidates in float; every distance is computed
// again in double.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "haptic_core/geometry/triangle_mesh.h"

namespace farfeel::bench {

/// Points within radius_m of a straight axis from p_O - half_length_m * axis_O to p_O + half_length_m * axis_O.
struct RoundTool {
  double radius_m = 0, half_length_m = 0;  ///< half_length_m 0: a ball
};

struct RoundToolPose {
  glm::dvec3 p_O{0};           ///< the middle
  glm::dvec3 axis_O{0, 0, 1};  ///< unit; of no meaning for a ball
  glm::dvec3 out_O{0, 0, 1};   ///< unit: where it came from, straight along this
  double way_m = 0;            ///< how far it has come since it was apart; 0: it is apart
};

/// One right answer: how far the tool must go along out_O, at least, to be free.
struct WayOut {
  double depth_m;  ///< > 0: it overlaps; < 0: it is apart by so much
  glm::dvec3 out_O;
};

/// Other ways out may face up to 120 degrees away from where the tool came from: sides of a fin, not a wall's back.
inline constexpr double kAsideCosine = -0.5;

struct TrueTouch {
  WayOut main;  ///< back to the side that it came from
  /// Where the tool's axis is in the material and another side, which does not face away from where it came from, is
  /// nearer: the way out there, right as well.
  std::optional<WayOut> aside{};
  /// The nearest surface is not the one that it came through: the axis is past the middle of the material, or beyond.
  bool is_past_middle = false;
  /// Other parts press it more than 90 degrees off `main`, at least half as deep: no direction is right.
  bool is_squeezed = false;

  /// Of all answers that are right, the one nearest to a told depth; and the least angle to a told direction [rad].
  [[nodiscard]] double depth_nearest_m(double told_m) const;
  [[nodiscard]] double angle_rad(const glm::dvec3& direction_O) const;
};

class TouchTruth {
 public:
  /// The mesh must outlive it. Queries are safe from several threads at once.
  explicit TouchTruth(const geometry::TriangleMesh& mesh_O);
  ~TouchTruth();
  TouchTruth(const TouchTruth&) = delete;
  TouchTruth& operator=(const TouchTruth&) = delete;

  /// The ways out of a ball whose middle is behind what faces out_O.
  [[nodiscard]] TrueTouch behind(const glm::dvec3& p_O, double radius_m, const glm::dvec3& out_O) const;
  [[nodiscard]] TrueTouch touch(const RoundTool&, const RoundToolPose&) const;
  /// From the tool's surface to the mesh, negative where they overlap; the tool's axis is outside.
  [[nodiscard]] double clearance_m(const RoundTool&, const RoundToolPose&) const;

  struct Nearest {
    double distance_m;
    glm::dvec3 q_O, nhat_O;  ///< the nearest point; of its triangle, outward
  };
  [[nodiscard]] Nearest nearest(const glm::dvec3& p_O) const;
  /// Of what faces out_O (normals less than 90 degrees from it, or up to least_cosine) and has p behind it.
  [[nodiscard]] std::optional<Nearest> nearest_in_front(const glm::dvec3& p_O, const glm::dvec3& out_O,
                                                        double least_cosine = 0) const;
  /// The first triangle on the straight way between two points.
  struct Crossing {
    double share;  ///< of the way, in [0, 1]
    glm::dvec3 nhat_O;
  };
  [[nodiscard]] std::optional<Crossing> first_crossing(const glm::dvec3& from_O, const glm::dvec3& to_O) const;

 private:
  struct Scene;
  struct AxisPoint;
  [[nodiscard]] AxisPoint at(const glm::dvec3& p_O, const RoundToolPose&) const;
  [[nodiscard]] AxisPoint deepest(const RoundTool&, const RoundToolPose&) const;
  [[nodiscard]] TrueTouch with_aside(TrueTouch, const glm::dvec3& p_O, double radius_m, const glm::dvec3& out_O) const;
  [[nodiscard]] bool is_squeezed(const RoundTool&, const RoundToolPose&, const WayOut&) const;

  const geometry::TriangleMesh& mesh_;
  std::unique_ptr<Scene> scene_;
};

}  // namespace farfeel::bench
