// How deep points of one surface are beneath another's felt facets, a leaf of points at a time, in plain types: see
// simd_kernels.h for why. foot_of() of the points' tests says the same of one point, plainly.
#pragma once

#include <cstdint>

namespace farfeel::penetration::simd {

inline constexpr int kLeafPoints = 16;
inline constexpr int kMostLeafFacets = 32;  ///< of a leaf that is felt; more are left out, the farthest first
inline constexpr int kMostSifted = 256;     ///< that are told apart for it

/// Where two triangles meet, their edge is as far as either: the one whose plane is farther is the one to ask which
/// side a point is on. Squares of distances are told apart by so much of the square of the height.
inline constexpr double kPrefersSquare = 1e-3;
/// Cosine between the normals of T and S: what looks the same way does not touch. A square edge, and a needle's flank,
/// still do.
inline constexpr double kFacesBelow = 0.05, kNotAbove = 0.4;
/// What faces a point may be farther than what does not, as a share of the depth: until it is not what the point
/// pressed through. Depths are not told apart by less than the last.
inline constexpr double kLeastNearness = 0.35, kFullNearness = 0.7, kNearnessWithin_m = 20e-6;

/// A flat triangle of S and where its texture is, in S's frame, as forms that are linear in a place: how high it is
/// above the plane; how far inside each edge; how far along each; the chart's s and t [texels] and the height above the
/// chart's coefficient zero.
struct alignas(64) FootFacet {
  static constexpr int kAbove = 0, kInside = 1, kAlong = 4, kChart = 7, kRows = 10;
  double anchor_S[3];  ///< a place of the triangle; floats are exact to 60 nm a metre from it
  float at_anchor[kRows], per[3][kRows];
  float length[3];               ///< of the edges
  const std::uint16_t* heights;  ///< as LaneChart's
  std::int32_t stride, columns, rows;
  float scale;
  float relief;  ///< how far the felt surface leaves the plane, at most
};

/// Points of one coarse triangle of T, near a centre.
struct FeetTask {
  const double* points_T;             ///< x, y, z of each
  std::int32_t count;                 ///< 1 to kLeafPoints
  std::uint32_t is_far;               ///< bits of those that are not asked about
  double R_ST[3][3], from_centre[3];  ///< row by row; T's origin from the centre, in S
  double centre_S[3];
  float nhat_S[3];            ///< of T's coarse triangle
  const FootFacet* facets;    ///< all of S
  const std::uint32_t* near;  ///< those that may matter
  std::int32_t near_count;    ///< up to kMostLeafFacets; to sift, up to kMostSifted
  float tolerance;            ///< how far from S points are looked for
  float lowest;               ///< no deeper is not of interest
};

/// How far points go, and how far they turn, without coming to other facets than those sifted.
struct FeetMargin {
  float way, turn;  ///< [m], [rad]
};

/// What is felt of a leaf. Places are from its centre, in S.
struct Feet {
  float depth[kLeafPoints], share[kLeafPoints];  ///< kNowhere and 0 where nothing is felt
  float p[3][kLeafPoints], slope[3][kLeafPoints];
  float ln_share_by_rotation[3][kLeafPoints];
  std::int32_t which[kLeafPoints];  ///< of FeetTask::near
};
struct FeetSeen {
  float deepest;  ///< of what is felt; kNowhere if nothing
  float most;     ///< of all points asked about: what they can be deeper than by the way since only; kEndlessWay where
                  ///< that is unknown
  bool is_all;    ///< none was left out for being no deeper than FeetTask::lowest
};

struct FeetSumTask {
  const Feet* feet;
  const float* counts;  ///< of FeetTask::near: 1 or 0
  float weight;         ///< of a point
  float level, lowest, width;
};
/// Sums over points of weight share exp((depth - level) / width), and of that times what the name says, about the
/// leaf's centre.
struct FeetSums {
  double weight, turning[3], moving[3], point[3];
};

}  // namespace farfeel::penetration::simd
