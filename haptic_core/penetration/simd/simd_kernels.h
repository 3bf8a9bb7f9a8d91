// The two loops in which the simd back end spends its time, in plain types: compiled once for each instruction set.
//
// Those sources are built with flags of their own, so nothing here may pull in inline code from other headers: the
// linker could keep the copy that a plain machine cannot run. Everything is float, relative to the contact frame.
#pragma once

#include <cstdint>

#include "haptic_core/penetration/simd/simd_feet.h"

namespace farfeel::penetration::simd {

inline constexpr int kMostLanes = 16;   ///< arrays are padded to a multiple of this
inline constexpr int kMostFacets = 64;  ///< of one side over one group of kMostLanes cells; more are ignored
inline constexpr float kNowhere = -1e30f;
inline constexpr float kAskew = 0.35f;  ///< tilt beyond which a chart may meet a ray more than once

/// A coarse triangle facing along the direction.
struct LaneFacet {
  float plane[3];      ///< z = plane[0] + plane[1] u + plane[2] v
  float inside[3][3];  ///< >= 0 inside, and the distance to the edge
  std::int32_t chart;  ///< index of what it is felt by
};

/// Where the texture of some facets is; one that is felt as coarse has one for itself. Lengths in metres, (s, t) in
/// texels.
struct LaneChart {
  float reach_up, reach_down;    ///< the greatest of its facets'
  float most_drift;              ///< across the chart, from a point of a facet to where it is felt
  const std::uint16_t* heights;  ///< null: felt as coarse. Row by row, spline coefficient (i, j) at (j + 1, i + 1)
  std::int32_t stride, columns, rows;
  float offset, scale, texels_per_m;
  float to_H[3][4];             ///< s, t [texels] and r [m] of (1, u, v, z)
  float axes[3][3];             ///< C's axes written in H
  float tilt;                   ///< sine between C's z and the chart's axis: how much parallax there is
  float toward;                 ///< +1 or -1: C's z runs with or against the chart
  const std::uint32_t* bounds;  ///< the level of height_bounds.h that suits the cells at hand; null: most_bend will do
  float most_bend;              ///< nowhere on the chart the surface bends upwards more [1/m]
  float most_slope;             ///< nor does it rise more steeply along C's plane
  float plane_slope, spare;     ///< of the plane below; how much farther than cells reach its bounds speak [m]
  std::int32_t bounds_columns, bounds_rows;
  float bounds_per_texel, bend_scale;  ///< entries a texel; [1/m] of one unit of bend
  float plane[3];  ///< the chart's plane: z = plane[0] + plane[1] u + plane[2] v; without texture, the facet's
  float lift;      ///< how far a height of one metre lifts it along z
};

struct LaneEdge {
  float a[3], along[3];  ///< an edge of the patch from a to a + along, in C
  float per_square;      ///< 1 / |along|^2 in the plane; 0 for an edge that stands upright
};

/// Boxes in C's plane, in columns padded to a multiple of kMostLanes with boxes that hold nothing.
struct LaneBoxes {
  const float *low_u, *high_u, *low_v, *high_v;
  std::int32_t count;
};

/// Lines in C's plane, in columns like the boxes': how far (u, v) is to their left, constant + per_u u + per_v v.
struct LaneLines {
  const float *constant, *per_u, *per_v;
};

/// One side of a contact: S, outward = +1, or T, outward = -1.
struct LaneSide {
  const LaneFacet* facets;
  const LaneChart* charts;
  const LaneEdge* edges;
  LaneLines facet_edges[3];           ///< to the left is inside
  LaneBoxes facet_boxes, edge_boxes;  ///< an edge's box is grown by the width of its fade
  float outward;
};

/// Square cells of C's plane, and what is found out about each of them.
struct LaneCells {
  float *u, *v;                  ///< centre
  float *s_z, *t_z;              ///< in: a guess of the felt heights there (cells without: NaN); out: the heights
  float *s_u, *s_v, *t_u, *t_v;  ///< slopes
  float *t_uu, *t_uv, *t_vv;     ///< [1/m]
  float* overlap;                ///< at the centre; kNowhere where a patch is missing
  float* faded;                  ///< the same plus width ln keep: what counts near a patch's own edge
  float* bound;                  ///< nowhere in the cell that is greater
  float* sharp;                  ///< how sharply the overlap bends down or, negative, falls over a soft width [1/m]
  /// How far the overlap may bend up from its slope, from the centre to a corner; negative where charts meet in the
  /// cell: then by each chart's slope.
  float* bow;
  float* stands;  ///< in and out: for how many of its kind a cell stands, >= 1
};

struct CellTask {
  LaneSide s, t;
  std::int32_t count;     ///< of cells
  float half;             ///< half a cell's side
  float reach;            ///< from a cell's centre to its corners
  float low[2], high[2];  ///< the window: cells beyond it do not count
  float deepest;          ///< coarse overlaps beyond belong to another layer
  float width, fade;      ///< soft width; how far from a patch's edge its weight fades
  float per_width;        ///< 1 / width
  float best, tail;       ///< cells bounded below best - tail get no closer look; best grows as cells are seen
  float safe;             ///< below the best by so much, none of those is missed
};

/// Places on a lattice to go to next, in the chosen ones of some cells. Its origin holds the cells, too.
struct LayTask {
  double origin[2];
  double cell, step;          ///< a cell's side; the lattice's
  double low[2], high[2];     ///< the window: at its ends, what stands for some of it is in the last cell
  float half;                 ///< of the side of what they stand for: step / 2 for cells, 0 for nodes of a sum
  float lowest;               ///< places that the cells' samples bound below it are left out
  std::int32_t chosen, most;  ///< how many cells; places that there is room for, but for kMostLanes more
};

/// What weighs in a fade and is lessened, in widths of it.
inline constexpr float kFadesShare = 0.37f;

/// What cells weigh, exp((faded overlap - best) / width) each, against the best.
struct WeightTask {
  std::int32_t count;  ///< of cells, a multiple of kMostLanes
  float step;          ///< a cell's side
  float best, width;
  float lowest;  ///< cells bounded below it are no longer of interest
  float safe;    ///< as in CellTask
  float near;    ///< cells above it tell how sharp the peak is
  float faded;   ///< what the fade must take from a cell before it counts as near an edge
  float fades;   ///< of a cell whose middle lies beyond an edge, the fade's share of its side
  float bins_per_m;
  std::int32_t bins;
};

struct Weights {
  std::int32_t sampled;           ///< cells whose overlap is known and not below WeightTask::lowest
  double known;                   ///< of all cells whose overlap is known
  double near, at_edge, falling;  ///< of cells above WeightTask::near; where LaneCells::sharp is negative
  double square_of_sharpness;     ///< theirs times sharp^2
  double least_way;               ///< as in Seen; of cells that were added up, to come so much nearer as they may
  double least_near_way;          ///< the same of near ones alone
  double outermost;               ///< of those that were added up, what weighs at a patch's very edge
  double in_fade;                 ///< of weighed cells: at_edge, but for the part that the fade does not reach
};

struct SumTask {
  LaneSide s, t;
  std::int32_t count;        ///< of cells
  float step;                ///< a cell's side
  float low[2], high[2];     ///< the window: cells count as far as they lie in it, and touch its border within a step
  float width, level, fade;  ///< soft width, overlap of weight one, fade's width
  float per_width;           ///< 1 / width
  float deepest;             ///< coarse overlaps beyond belong to another layer
  float tail, near, faded;   ///< below the level: what still counts as sampled, as near; and as in WeightTask
  float nearer;              ///< how much what is left out on the flanks may come nearer
  float outermost;           ///< what the fade must take from a cell before it counts as at the very edge
  float To[3];
  bool wants_hessian;
};

/// Sums over cells of weight times what the name says. Without the last coordinate, T's motion along z: there the
/// gradient is -weight, and second derivatives vanish.
struct Sums {
  double weight, edge, border, steep;
  double noise;    ///< variance of the weight, in which some cells stand for others, if each was drawn by itself
  double squares;  ///< of the weights
  double point[3];
  double gradient[5];
  double square[15];     ///< of the gradient with itself: the lower triangle, row by row
  double curvature[15];  ///< of the overlap and of the fades: likewise
};

/// Cells that a sum may be made of again: centres, the heights of both sides there, and what they stand for. In columns
/// with room for kMostLanes more.
struct CellStore {
  float *u, *v, *s_z, *t_z, *stands;
  float lowest;  ///< overlaps, with the fade, below it are not wanted
  std::int32_t room, count;
};

/// The greatest overlap seen, at least task.best; how many cells are left. What was left out reaches best - safe after
/// the surfaces have moved so far along each other, at the earliest [m].
struct Seen {
  float best;
  std::int32_t left;
  float least_way;
};
inline constexpr float kEndlessWay = 1e9f;

struct Kernels {
  /// Moves the cells together that the relief may lift to best - tail, and says how many they are. Fills their bound.
  Seen (*sift)(const CellTask&, const LaneCells&);
  /// The same, and samples them as it goes.
  Seen (*look_at)(const CellTask&, const LaneCells&);
  /// Writes the places, row by row, with the heights that the cells' slopes tell. Each lies in one cell. Returns their
  /// number; or, where they may be more than task.most, something greater, and nothing of use is written.
  std::int32_t (*lay)(const LayTask&, const LaneCells& cells, const std::uint32_t* chosen, const LaneCells& places);
  /// Lists the cells bounded at lowest or above, and by how many bins each lies below the best, at most bins - 1.
  /// Returns their number. Both lists need room for kMostLanes more.
  std::int32_t (*weigh)(const WeightTask&, const LaneCells&, std::int32_t* cell, std::int32_t* bin, Weights&);
  /// Of cells that look_at has sampled.
  void (*add_up)(const SumTask&, const LaneCells&, Sums&);
  /// Samples cells, by their centres and the guesses of heights there, and adds them up, without second derivatives.
  /// Their weights tell whether the step was fine enough. Returns the greatest overlap seen. Those that may be wanted
  /// again are added to the store, if there is one; more than fit leave its count above its room.
  float (*sample_and_add)(const SumTask&, const LaneCells&, Sums&, Weights&, CellStore*);
  /// Lists the facets that any point may be felt against while it stays within the margin. Returns their number.
  std::int32_t (*sift_facets)(const FeetTask&, const FeetMargin&, std::uint32_t* kept);
  FeetSeen (*feel)(const FeetTask&, Feet&);
  void (*add_feet)(const FeetSumTask&, FeetSums&);
  const char* name;
};

extern const Kernels kPlain;
#if defined(__x86_64__)
extern const Kernels kAvx2, kAvx512;
#endif

}  // namespace farfeel::penetration::simd
