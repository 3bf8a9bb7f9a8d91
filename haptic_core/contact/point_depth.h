// How deep two felt surfaces overlap where no direction shows them as height fields: points of T's displaced surface
// against the nearest place of S's, along S's own normals.
//
// Over points p_i that ride on T, each standing for an area a_i of it, and with d_i the height of S's displaced surface
// above p_i, along the axis of the chart that is nearest,
//   depth = w ln[(1 / a0) sum a_i exp(d_i / w)],   gradient = sum of the shares of the weights times the slope of d_i:
// a function of the pose alone, whatever the clusters' directions do, and its own derivative.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "haptic_core/collision/proximity.h"
#include "haptic_core/contact/cluster.h"
#include "haptic_core/contact/coarse_depth.h"
#include "haptic_core/penetration/felt_surface.h"
#include "haptic_core/spatial/spatial.h"

namespace farfeel::contact {

/// A surface's triangles as planes with edges, and where their heights are.
class FacetedSurface {
 public:
  struct Facet {
    std::array<glm::dvec3, 3> corners_O;
    std::array<glm::dvec3, 3> along_O, inward_O;  ///< of edge (k, k + 1): unit, in the plane
    std::array<double, 3> length_m;
    glm::dvec3 nhat_O, centre_O;
    double reach_m, area_m2;     ///< from the centre to the corners
    std::uint32_t piece, chart;  ///< chart: geometry::kNoChart where felt as coarse
    glm::dmat3 R_OH;
    glm::dvec3 p_OH;
  };
  explicit FacetedSurface(const penetration::FeltSurface&);

  [[nodiscard]] const Facet& facet(std::uint32_t triangle) const { return facets_[triangle]; }
  [[nodiscard]] const penetration::FeltSurface& felt() const { return *felt_; }
  /// How far the felt surface leaves the coarse one, at most.
  [[nodiscard]] double most_relief_m() const { return most_relief_m_; }

 private:
  const penetration::FeltSurface* felt_;
  double most_relief_m_ = 0;
  std::vector<Facet> facets_;
};

/// One thread at a time; the surfaces outlive it.
class PointDepth {
 public:
  /// tolerance_m: what pairs are nearer than.
  PointDepth(const FacetedSurface& s, const FacetedSurface& t, double tolerance_m);

  /// Depth of the points of the cluster's pieces of T whose nearest place of S is on one of the cluster's pieces, and
  /// does not face against its direction. pairs: all near ones of S and T, from which the pieces of S near each of T's
  /// are known. Points further than 9 soft widths below the deepest are left out. -infinity when no point counts.
  /// Realtime-safe: allocates nothing; bounded by the number of points.
  [[nodiscard]] CoarseDepth evaluate(const Cluster&, std::span<const collision::ProximityPair> pairs,
                                     const spatial::Pose& X_ST, double soft_width_m) noexcept;

  /// That the last depth was made of.
  [[nodiscard]] std::uint32_t points() const { return points_; }

 private:
  static constexpr std::size_t kMostPieces = 96;            ///< of S near one piece of T; more are left out
  static constexpr std::size_t kMostCandidates = 1u << 16;  ///< triangles of S near all of T's; likewise
  static constexpr int kMostLevels = 8;

  struct Sums;
  /// A triangle of T or a part of it, and the triangles of S that may be nearest to it.
  struct Cell {
    std::array<glm::dvec3, 3> corners_T, corners_S;
    std::uint32_t triangle, first, count;  ///< [first, first + count) of candidates_
    int level;
    double deepest_m;  ///< no point of it is deeper
  };
  void list_pieces_near(const Cluster&, std::span<const collision::ProximityPair>) noexcept;
  [[nodiscard]] bool narrow(Cell&, double lowest_m) noexcept;
  void look_into(const Cell&, double point_m, Sums&) noexcept;
  void feel(const Cell&, Sums&) noexcept;

  const FacetedSurface &s_, &t_;
  double tolerance_m_;
  std::vector<std::uint32_t> slot_of_t_;  // of a piece of T in the cluster's list; kNone
  std::vector<std::uint8_t> counts_;      // whether a piece of S is the cluster's
  std::array<std::array<std::uint32_t, kMostPieces>, kMaxClusterPieces> near_;
  std::array<std::uint32_t, kMaxClusterPieces> near_count_{};
  std::vector<std::uint32_t> candidates_;  // triangles of S: a stack
  std::vector<double> distances_m_;        // of those that are being narrowed
  std::vector<Cell> whole_, cells_;        // T's triangles, the deepest first; a stack of their parts
  std::uint32_t points_ = 0;
};

}  // namespace farfeel::contact
