// How deep two felt surfaces overlap where no direction shows them as height fields: points of T's displaced surface
// against the nearest place of S's, whichever way that is.
//
// Over points p_i that ride on T, each standing for an area a_i of it, and with d_i the distance of p_i to the nearest
// place of S's displaced surface that faces it, positive beneath it,
//   depth = w ln[(1 / a0) sum c_i a_i exp(d_i / w)],   gradient = its derivative.
// c_i, in [0, 1], says how much that place is what p_i pressed through: it falls with how squarely the two face, and
// where p_i is nearer to another side of S. The far side of T's tooth is in S's flank, too, when it is pressed.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/contact/cluster.h"
#include "haptic_core/contact/coarse_depth.h"
#include "haptic_core/contact/faceted_surface.h"
#include "haptic_core/contact/nearest_facets.h"
#include "haptic_core/contact/surface_points.h"

namespace farfeel::contact {

/// One point of T against S.
struct PointFoot {
  double depth_m = 0;
  double share = 0;  ///< c_i; 0: nothing of S that faces it is within the tolerance, and the rest is unknown
  glm::dvec3 p_S{0}, slope_S{0};                            ///< d depth / d p_S
  glm::dvec3 ln_share_slope_S{0}, ln_share_by_rotation_S{0};  ///< of p_S [1/m], of T about p_S [1/rad]
  std::uint32_t facet = 0;                                  ///< of S
};
/// facets: of S, those that may be nearest to p_S; nhat_S: T's coarse normal at the point.
[[nodiscard]] PointFoot foot_of(const FacetedSurface& s, std::span<const std::uint32_t> facets, const glm::dvec3& p_S,
                                const glm::dvec3& nhat_S, double tolerance_m) noexcept;

/// One thread at a time; the surfaces outlive it.
class PointDepth {
 public:
  /// tolerance_m: points are looked for down to this far beneath S.
  PointDepth(const FacetedSurface& s, SurfacePoints& t, double tolerance_m);

  /// Depth of the points of the cluster's pieces of T whose nearest place of S is on one of the cluster's pieces, and
  /// does not face against its direction. Points further than 8 soft widths below the deepest are left out. -infinity
  /// when no point counts. What is found out at a pose serves the next clusters there.
  /// Realtime-safe: allocates nothing; bounded by kMostFeet of all points at a pose, coarser parts beyond.
  [[nodiscard]] CoarseDepth evaluate(const Cluster&, const spatial::Pose& X_ST, double soft_width_m) noexcept;

  /// How many were looked at for the last depth, which the clusters before had not asked for.
  [[nodiscard]] std::uint32_t points() const { return points_; }

  static constexpr std::uint32_t kMostFeet = 20'000;

 private:
  struct Sums;
  struct Part;
  struct Whole {
    std::uint32_t triangle;
    double deepest_m;  ///< no point of it is deeper
  };
  void go_to(const spatial::Pose& X_ST) noexcept;
  void forget() noexcept;
  [[nodiscard]] double deepest_m(const Part&) noexcept;
  [[nodiscard]] double bound_of(const Part&) const noexcept;
  void look_into(const Part&, Sums&) noexcept;
  void feel(const Part&, Sums&) noexcept;

  const FacetedSurface& s_;
  SurfacePoints& t_;
  double tolerance_m_;
  NearestFacets nearest_;
  std::vector<std::uint8_t> counts_;  // whether a piece of S is the cluster's
  std::vector<Whole> whole_;          // the cluster's triangles of T, the deepest first
  // Of the pose at hand: what points were found out about, and which of them is a point's, if it is this pose's.
  std::vector<PointFoot> feet_;
  struct Found {
    std::uint32_t pose = 0, foot = 0;
    double depth_m = 0;
  };
  std::vector<Found> found_;
  struct Bound {
    std::uint32_t pose = 0;
    double deepest_m = 0;
  };
  std::vector<std::uint32_t> part_first_;  // of each triangle's parts, itself first, level by level
  std::vector<Bound> bounds_;
  spatial::Pose X_ST_;
  glm::dmat3 R_ST_{1};
  std::uint64_t s_changes_ = 0, t_changes_ = 0;
  std::uint32_t pose_ = 0, points_ = 0;
};

}  // namespace farfeel::contact
