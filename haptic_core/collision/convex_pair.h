// Two convex hulls, written in one frame: how far apart, or how deep.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "haptic_core/collision/convex_hull.h"
#include "haptic_core/collision/proximity.h"

namespace farfeel::collision {

/// A hull's vertices: count is a multiple of four, >= 4; the last vertex is repeated to fill up.
struct HullVertices {
  const double *x, *y, *z;
  std::uint32_t count;
  [[nodiscard]] glm::dvec3 at(std::uint32_t i) const { return {x[i], y[i], z[i]}; }
};

/// A hull's faces as planes: count is a multiple of four; what fills up has no normal and an infinite offset.
struct HullFaces {
  const double *x, *y, *z, *offset_m;
  std::uint32_t count;
  [[nodiscard]] glm::dvec3 normal(std::uint32_t i) const { return {x[i], y[i], z[i]}; }
};

/// A hull with the directions its surface faces (outwards; none: every direction) and its OutwardMap, in one frame.
struct HullShape {
  HullVertices vertices;
  HullFaces faces;
  std::span<const HullEdge> edges;
  std::span<const std::array<std::uint32_t, 2>> edge_faces;  ///< HullEdge::faces of each, close together
  const std::uint32_t* edges_at;  ///< edges_at[edges_at[v]] ... edges_at[edges_at[v + 1]] (without) meet at vertex v
  HullVertices outwards;          ///< unit vectors; none: count is 0
  std::uint32_t outward_faces, outward_edges;  ///< how many of them, from the front, matter to outward directions
};

/// Pose of frame B in frame A: p_A = R * p_B + p.
struct Placement {
  glm::dmat3 R{1};
  glm::dvec3 p{0};
};

/// Up to four pairs of vertices (one of A, one of B) whose differences b - a hold the point nearest to the origin, or
/// the origin itself. Kept from one query to the next: a good guess makes the next one fast; any guess in range is
/// safe.
struct PairSimplex {
  std::uint32_t count = 0;
  std::array<std::uint32_t, 4> a{}, b{};
};

enum class Apartness : std::uint8_t {
  kApart,     ///< distance and witnesses are exact to rounding
  kBeyond,    ///< farther than asked; distance_m is a lower bound
  kTouching,  ///< nearer than rounding, or overlapping: ask least_translation()
};

struct Separation {
  Apartness apartness;
  double distance_m;
  glm::dvec3 nhat;      ///< unit, out of A, into B, for kApart
  glm::dvec3 p_a, p_b;  ///< witnesses, for kApart
};

/// Distance of A and B by the method of Gilbert, Johnson and Keerthi, warm-started. Bounded; no allocation.
/// Stops early when the distance exceeds `beyond_m`. rounding_m: distances below it are touching; about 1e-12 of the
/// coordinates' size.
[[nodiscard]] Separation separation(const HullVertices& A, const HullVertices& B, double beyond_m, double rounding_m,
                                    PairSimplex&) noexcept;

/// The feature of a hull on which a distance's witness lies, from the simplex that separation() left and the vertices
/// of this hull in it (simplex.a or simplex.b).
[[nodiscard]] HullFeature feature_of(const HullShape&, std::uint32_t count,
                                     const std::array<std::uint32_t, 4>& vertices) noexcept;

/// Where a least translation was found: of which faces or edges its direction is the normal. As a guess for the next
/// query it is safe while the indices are in range.
struct TranslationAxis {
  enum class Kind : std::uint8_t { kUnknown, kFaceOfA, kFaceOfB, kEdges };
  Kind kind = Kind::kUnknown;
  std::uint32_t a = 0, b = 0;  ///< index of A's and of B's face or edge
};

struct LeastTranslation {
  double depth_m;        ///< moving B by depth_m along direction makes A and B just touch; negative by rounding only
  glm::dvec3 direction;  ///< unit, out of A, into B
  glm::dvec3 p_a, p_b;   ///< (p_a - p_b) . direction = depth_m
  bool is_admissible;    ///< see ProximityPair
  HullFeature feature_a, feature_b;
};

/// Two hulls, each in its own frame, and their vertices written in the other's.
struct PlacedPair {
  HullShape A, B;
  HullVertices a_in_B, b_in_A;
  Placement X_AB;
};

/// Working memory of least_translation() for hulls of at most so many faces and edges.
struct TranslationScratch {
  TranslationScratch(std::size_t most_faces, std::size_t most_edges);
  std::vector<double> overlap_m;
  std::vector<std::uint64_t> out_a, out_b;
  std::vector<std::uint32_t> faces_left, edges_a, edges_b;
};

/// The least translation that separates overlapping or touching hulls, in A's frame. Bounded; no allocation.
/// One of enough_m or less is as good as the least: the search ends there.
[[nodiscard]] LeastTranslation least_translation(const PlacedPair&, TranslationAxis& guess, TranslationScratch&,
                                                 double enough_m = -std::numeric_limits<double>::infinity()) noexcept;

/// Whether the guess is admissible and parts the hulls already: then least_translation() with enough_m = 0 would end
/// there, where it begins, and leave the guess as it is.
[[nodiscard]] bool is_parted_by(const PlacedPair&, const TranslationAxis& guess, TranslationScratch&) noexcept;

}  // namespace farfeel::collision
