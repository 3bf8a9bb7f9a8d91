// How deep two felt surfaces overlap where no direction shows them as height fields: points of T's displaced surface
// against the nearest place of S's, whichever way that is.
//
// Over points p_i that ride on T, each standing for an area a_i of it, and with d_i the distance of p_i to the nearest
// place of S's displaced surface that faces it, positive beneath it,
//   depth = w ln[(1 / a0) sum c_i a_i exp(d_i / w)],   gradient = its derivative.
// c_i, in [0, 1], says how much that place is what p_i pressed through: it falls with how squarely the two face, and
// where p_i is nearer to another side of S. The far side of T's tooth is in S's flank, too, when it is pressed. Of one
// point foot_of() of the tests says it plainly; here sixteen are looked at together (penetration/simd/simd_feet.h).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "haptic_core/contact/cluster.h"
#include "haptic_core/contact/depth/points/faceted_surface.h"
#include "haptic_core/contact/depth/points/nearest_facets.h"
#include "haptic_core/contact/depth/points/surface_points.h"
#include "haptic_core/contact/depth_source.h"
#include "haptic_core/penetration/simd/simd.h"
#include "haptic_core/penetration/simd/simd_feet.h"

namespace farfeel::contact {

/// One thread at a time; the surfaces outlive it.
class PointDepth {
 public:
  /// tolerance_m: points are looked for down to this far beneath S.
  PointDepth(const FacetedSurface& s, SurfacePoints& t, double tolerance_m,
             penetration::InstructionSet = penetration::InstructionSet::kBest);

  /// Depth of the points of the cluster's pieces of T that face against its direction, and whose nearest place of S is
  /// on one of the cluster's pieces. Points that weigh next to nothing are left out. -infinity when
  /// no point counts. What is found out at a pose serves the next clusters there. Realtime-safe: allocates nothing;
  /// bounded by kMostLeaves of all points' leaves at a pose, coarser parts beyond.
  [[nodiscard]] DepthSource evaluate(const Cluster&, const spatial::Pose& X_ST, double soft_width_m) noexcept;

  /// Forgets what was found out at earlier poses.
  void restart() noexcept { is_known_ = false; }

  /// How many were looked at for the last depth, which the clusters before had not asked for.
  [[nodiscard]] std::uint32_t points() const { return points_; }

  static constexpr std::uint32_t kMostLeaves = 2'500;

 private:
  struct Sums;
  struct Part;
  struct Whole {
    std::uint32_t triangle;
    double along, deepest_m;  ///< how much its points count; no point of it is deeper
  };
  /// Where a leaf was, how far T had turned then, and with which heights.
  struct Place {
    glm::dvec3 centre_S{0};
    double turned = 0;
    std::uint32_t heights = 0;
  };
  /// Some points of one triangle of T, at most simd::kLeafPoints.
  struct Leaf {
    Place sifted, felt;
    double radius_m = 0, far_m = 0;    ///< of all its points; the same of those far from S when it was sifted
    double most_m = 0;                 ///< no point was deeper when it was felt
    std::uint32_t pose = 0, foot = 0;  ///< of feet_, at that pose
    std::uint32_t is_far = 0;          ///< bits of those far from S
    std::uint32_t count = 0;           ///< of facets
    std::array<std::uint32_t, penetration::simd::kMostLeafFacets>
        facets;  ///< of S, that suffice near where it was sifted
  };
  struct Felt {
    Felt() noexcept {}  // filled by whoever makes it
    glm::dvec3 centre_S;
    float deepest_m, lowest_m;  ///< below the latter some may be left out
    penetration::simd::Feet feet;
  };
  void go_to(const spatial::Pose& X_ST) noexcept;
  [[nodiscard]] double deepest_m(const Part&) noexcept;
  [[nodiscard]] double bound_of(const Part&) const noexcept;
  [[nodiscard]] double look_into(const Part&, Sums&) noexcept;
  [[nodiscard]] double feel(const Part&, Sums&) noexcept;
  [[nodiscard]] Leaf& leaf_at(const Part&) noexcept;
  [[nodiscard]] double way_m(const Place&, const Leaf&, const glm::dvec3& centre_S) const noexcept;
  [[nodiscard]] Place here(const glm::dvec3& centre_S) const noexcept { return {centre_S, turned_, heights_}; }
  void sift(Leaf&, const penetration::simd::FeetTask&) noexcept;
  void add(const Part&, const Leaf&, Sums&) noexcept;

  const FacetedSurface& s_;
  SurfacePoints& t_;
  double tolerance_m_;
  const penetration::simd::Kernels& kernels_;
  std::shared_ptr<const NearestFacets> nearest_;
  std::vector<penetration::simd::FootFacet> facets_;  // of S
  std::vector<std::uint32_t> piece_of_;               // of each of them
  std::vector<std::uint8_t> counts_;                  // whether a piece of S is the cluster's
  std::vector<Whole> whole_;                          // the cluster's triangles of T, the deepest first
  std::vector<Felt> felt_;                            // at the pose at hand
  std::vector<std::uint32_t> leaf_first_;             // of each triangle
  std::vector<Leaf> leaves_;
  std::vector<std::uint32_t> sifted_, seen_;  // facets for the leaf at hand; of each, for which it was last
  std::uint32_t sifting_ = 0;
  // Of each part that is more than a leaf: what it was no deeper than when T's way was so long, and so now by the way
  // since.
  struct Bound {
    double way_m = -std::numeric_limits<double>::infinity(), deepest_m = 0;
  };
  [[nodiscard]] Bound& bound_at(const Part&) noexcept;
  std::vector<std::uint32_t> part_first_;  // of each triangle's such parts, itself first, level by level
  std::vector<Bound> bounds_;
  double way_m_ = 0, turned_ = 0, arm_m_ = 0;  // T's way and turns so far, at most; of its farthest point
  spatial::Pose X_ST_;
  glm::dmat3 R_ST_{1};
  bool is_known_ = true;  // what was found out at the pose at hand still holds
  std::uint64_t s_changes_ = 0, t_changes_ = 0;
  std::uint32_t heights_ = 1, pose_ = 0, points_ = 0;
};

}  // namespace farfeel::contact
