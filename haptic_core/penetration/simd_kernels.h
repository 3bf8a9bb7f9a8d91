// The two loops in which the simd back end spends its time, in plain types: compiled once for each instruction set.
//
// Those sources are built with flags of their own, so nothing here may pull in inline code from other headers: the
// linker could keep the copy that a plain machine cannot run. Everything is float, relative to the contact frame.
#pragma once

#include <cstdint>

namespace farfeel::penetration::simd {

inline constexpr int kMostLanes = 16;   ///< node counts are padded to a multiple of this
inline constexpr int kMostFacets = 64;  ///< over one group of kMostLanes nodes; more are ignored
inline constexpr float kNowhere = -1e30f;

/// A coarse triangle facing along the direction, and where its texture is. Lengths in metres, (s, t) in texels.
struct LaneFacet {
  float low[2], high[2];  ///< its box in C's plane
  float plane[3];         ///< z = plane[0] + plane[1] u + plane[2] v
  float inside[3][3];     ///< >= 0 inside
  float reach_up, reach_down;
  float most_drift;              ///< across the chart, from a point of the triangle to where it is felt
  const std::uint16_t* heights;  ///< null: felt as coarse. Row by row, spline coefficient (i, j) at (j + 1, i + 1)
  std::int32_t stride, columns, rows;
  float offset, scale, texels_per_m;
  float to_H[3][4];  ///< s, t [texels] and r [m] of (1, u, v, z)
  float axes[3][3];  ///< C's axes written in H
  float tilt;        ///< sine between C's z and the chart's axis: how much parallax there is
  float toward;      ///< +1 or -1: C's z runs with or against the chart
};

struct LaneEdge {
  float a[3], along[3];   ///< an edge of the patch from a to a + along, in C
  float per_square;       ///< 1 / |along|^2 in the plane; 0 for an edge that stands upright
  float low[2], high[2];  ///< its box, grown by the fade's width
};

/// Outputs of overlaps_at, an entry a node. overlap is kNowhere where a patch is missing.
struct LaneOverlaps {
  float *overlap, *s_u, *s_v, *t_z, *t_u, *t_v;
};

struct OverlapTask {
  const LaneFacet *s, *t;
  std::int32_t s_count, t_count;
  const float *u, *v;
  std::int32_t count;     ///< of nodes, a multiple of kMostLanes
  std::int32_t steps;     ///< of Newton
  float deepest, margin;  ///< groups that can't come within margin of the best overlap so far are left at kNowhere
};

struct SumTask {
  const LaneEdge *s, *t;
  std::int32_t s_count, t_count;
  const float *u, *v, *area;  ///< area < 0 marks a node at the window's border
  std::int32_t count;
  float width, level, fade;  ///< soft width, overlap of weight one, fade's width
  float To[3];
};

/// Sums over nodes of weight times what the name says; gradient without its last entry, which is -weight.
struct Sums {
  double weight, edge, border, steep;
  double point[3];
  double gradient[5];
};

struct Kernels {
  void (*overlaps_at)(const OverlapTask&, const LaneOverlaps&);
  void (*add_up)(const SumTask&, const LaneOverlaps&, Sums&);
  const char* name;
};

extern const Kernels kPlain;
#if defined(__x86_64__)
extern const Kernels kAvx2, kAvx512;
#endif

}  // namespace farfeel::penetration::simd
