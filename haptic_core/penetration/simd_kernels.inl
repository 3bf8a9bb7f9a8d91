// Included by simd_plain.cpp, simd_avx2.cpp and simd_avx512.cpp after simd_lanes.inl. FARFEEL_KERNELS: the table's
// name.
//
// look_at: both sides are treated alike by measuring y = outward z, in which either surface's texture rises away from
// its own body: the overlap is d = y_S + y_T, felt is the greatest y, and only upward bends can hide a greater overlap
// between two samples. Over a cell of reach r around its centre, with g the slope there,
//   d <= y_S + y_T + |g_S + g_T| . half + (bend_S + bend_T) r^2 / 2    and    d <= the same of two planes above the
//   relief,
// where |g| . half, with half the cell's half sides, is how far a plane of slope g rises to a corner.
#include "haptic_core/penetration/simd_fades.inl"
#include "haptic_core/penetration/simd_heights.inl"

namespace farfeel::penetration::simd {
namespace {

constexpr float kSteepest = 2.7475f;  // slope of a surface that stands at 70 degrees
constexpr float kOnEdge = 1e-8f;      // [m] cells this close outside still count: neighbours leave no gap

/// Half the sides of a cell, and from its centre to a corner.
struct Half {
  float u, v, reach;

  [[nodiscard]] F rise(F slope_u, F slope_v) const { return size_of(slope_u) * u + size_of(slope_v) * v; }
};

/// The facets of one side that touch a group of cells.
struct Touched {
  int facets[kMostFacets];
  I touching[kMostFacets];
  F bend[kMostFacets];
  int count = 0;
  F coarse_y;           // of the felt facet's plane at the centre
  F lowest_y;           // of any touching facet's plane at the centre
  I felt;               // index into facets of the facet felt at the centre, -1 without
  I touched;            // any
  F top, top_u, top_v;  // a plane above everything felt in the cell, as its height at the centre and its slope
};

/// Where Newton begins. A chart that leans much may meet a ray more than once: there every ray starts at the coarse
/// facet, as in the reference, so that what it finds depends on the pose alone and not on how the search came by.
inline F start_over(const LaneFacet& f, F coarse_z, F guess_z) {
  if (f.tilt > kAskew) return coarse_z;
  return guess_z == guess_z ? guess_z : coarse_z + 0.5f * (f.reach_up + f.reach_down);
}

inline Touched touched_by(const LaneSide& side, F u, F v, F guess_z, const Half& half, const Box& box) {
  const float reach = half.reach;
  Touched all_of;
  all_of.coarse_y = all_of.top = all(kNowhere);
  all_of.lowest_y = all(-kNowhere);
  all_of.top_u = all_of.top_v = F{};
  all_of.felt = I{} - 1;
  all_of.touched = I{};
  for (int first = 0; first < side.facet_boxes.count; first += kLanes) {
    unsigned near = meeting(side.facet_boxes, first, box, reach);
    for (; near != 0 && all_of.count < kMostFacets; near &= near - 1) {
      const int i = first + __builtin_ctz(near);
      const LaneFacet& f = side.facets[i];
      F inside = f.inside[0][0] + f.inside[0][1] * u + f.inside[0][2] * v;
      for (int k = 1; k < 3; ++k) inside = least(inside, f.inside[k][0] + f.inside[k][1] * u + f.inside[k][2] * v);
      const I touches = inside >= -reach;
      if (bits_of(touches) == 0) continue;
      const F z = f.plane[0] + f.plane[1] * u + f.plane[2] * v, y = side.outward * z;
      const I wins = (inside >= -kOnEdge) & (y > all_of.coarse_y);
      all_of.coarse_y = wins ? y : all_of.coarse_y;
      all_of.felt = wins ? I{} + all_of.count : all_of.felt;
      all_of.lowest_y = touches & (y < all_of.lowest_y) ? y : all_of.lowest_y;
      // Slopes of the plane that bounds the texture are the chart's own.
      const float top_u = side.outward * f.chart[1], top_v = side.outward * f.chart[2];
      F top = y;
      all_of.bend[all_of.count] = F{};
      if (f.heights) {
        const Limit limit = limit_over(f, u, v, start_over(f, z, guess_z));
        all_of.bend[all_of.count] = limit.bend;
        top = side.outward * limit.top;
      }
      const I is_first = touches & ~all_of.touched, again = touches & all_of.touched;
      if (bits_of(again) != 0) {
        const F du = top_u - all_of.top_u, dv = top_v - all_of.top_v;
        all_of.top = again ? most(all_of.top, top + half.rise(du, dv)) : all_of.top;
      }
      all_of.top = is_first ? top : all_of.top;
      all_of.top_u = is_first ? all(top_u) : all_of.top_u;
      all_of.top_v = is_first ? all(top_v) : all_of.top_v;
      all_of.touched |= touches;
      all_of.facets[all_of.count] = i;
      all_of.touching[all_of.count++] = touches;
    }
  }
  return all_of;
}

/// One side's felt surface over a group of cells.
struct Side {
  Height felt;          // at the centre, by the facet that is felt there
  F y, y_u, y_v, bend;  // bounds everything felt in the cell
  F turn;               // greatest difference of slopes between facets of the cell
  I known;              // where any facet touches
};

inline Side side_over(const LaneSide& side, const Touched& by, F u, F v, F guess_z, const Half& half) {
  Side over{};
  over.felt.z = all(kNowhere);
  for (int k = 0; k < by.count; ++k) {
    const LaneFacet& f = side.facets[by.facets[k]];
    const F coarse_z = f.plane[0] + f.plane[1] * u + f.plane[2] * v;
    const I mine = by.felt == I{} + k, near = by.touching[k];
    const Height h = height_over(f, u, v, start_over(f, coarse_z, guess_z), coarse_z, near);
    over.felt.z = mine ? h.z : over.felt.z;
    over.felt.z_u = mine ? h.z_u : over.felt.z_u;
    over.felt.z_v = mine ? h.z_v : over.felt.z_v;
    over.felt.z_uu = mine ? h.z_uu : over.felt.z_uu;
    over.felt.z_uv = mine ? h.z_uv : over.felt.z_uv;
    over.felt.z_vv = mine ? h.z_vv : over.felt.z_vv;
    over.felt.is_met |= mine & h.is_met;
    const F stretch = 1 + f.tilt * (size_of(h.z_u) + size_of(h.z_v)), bend = by.bend[k] * stretch * stretch;
    const F y = side.outward * h.z, y_u = side.outward * h.z_u, y_v = side.outward * h.z_v;
    const I is_first = near & ~over.known, again = near & over.known;
    if (bits_of(again) != 0) {
      const F du = y_u - over.y_u, dv = y_v - over.y_v, turn = root(du * du + dv * dv);
      over.y = again ? most(over.y, y + half.rise(du, dv)) : over.y;
      over.turn = again ? most(over.turn, turn) : over.turn;
    }
    over.y = is_first ? y : over.y;
    over.y_u = is_first ? y_u : over.y_u;
    over.y_v = is_first ? y_v : over.y_v;
    over.bend = near ? most(over.bend, bend) : over.bend;
    over.known |= near;
  }
  return over;
}

float look_at(const CellTask& task, const LaneCells& cells) {
  float best = task.best;
  const Half half{task.half_u, task.half_v, task.reach};
  const float r = half.reach;
  for (int n = 0; n < task.count; n += kLanes) {
    const F u = load(cells.u + n), v = load(cells.v + n);
    const F s_guess = load(cells.s_z + n), t_guess = load(cells.t_z + n);
    store(cells.overlap + n, all(kNowhere));
    store(cells.faded + n, all(kNowhere));
    store(cells.bound + n, all(kNowhere));
    const Box box = box_of(u, v);
    const Touched s_by = touched_by(task.s, u, v, s_guess, half, box);
    if (s_by.count == 0) continue;
    const Touched t_by = touched_by(task.t, u, v, t_guess, half, box);
    // What is certainly another layer does not count, nor what the relief can't lift to the best.
    F du = s_by.top_u + t_by.top_u, dv = s_by.top_v + t_by.top_v;
    const F relief_bound = s_by.top + t_by.top + half.rise(du, dv);
    const I shared = s_by.touched & t_by.touched & (s_by.lowest_y + t_by.lowest_y <= task.deepest + 2 * r);
    F bound = shared ? relief_bound : all(kNowhere);
    if (bits_of(shared & (relief_bound >= best - task.tail)) == 0) {
      store(cells.bound + n, bound);
      continue;
    }
    const Side s = side_over(task.s, s_by, u, v, s_guess, half);
    const Side t = side_over(task.t, t_by, u, v, t_guess, half);
    du = s.y_u + t.y_u, dv = s.y_v + t.y_v;
    const F sample_bound = s.y + t.y + half.rise(du, dv) + (0.5f * r * r) * (s.bend + t.bend);
    bound = shared ? least(relief_bound, sample_bound) : bound;
    const I known = (s_by.felt >= I{}) & (t_by.felt >= I{}) & (s_by.coarse_y + t_by.coarse_y <= task.deepest) &
                    s.felt.is_met & t.felt.is_met;
    const F overlap = known ? s.felt.z - t.felt.z : all(kNowhere);
    F faded = overlap;
    const Fade s_fade = fade_over(task.s, u, v, box, task.fade), t_fade = fade_over(task.t, u, v, box, task.fade);
    if (s_fade.is_near || t_fade.is_near) {
      const F keep = most(s_fade.keep * t_fade.keep, all(1e-20f));
      const F most_keep = most_kept(s_fade, task.fade, r) * most_kept(t_fade, task.fade, r);
      faded = known ? overlap + task.width * logarithm(keep) : overlap;
      bound = shared ? bound + task.width * logarithm(most_keep) : bound;
    }
    const float greatest = greatest_of(faded);
    best = greatest > best ? greatest : best;
    // Greatest eigenvalue of minus the overlap's second derivative; a crease counts as what it is over the soft width.
    const F uu = s.felt.z_uu - t.felt.z_uu, uv = s.felt.z_uv - t.felt.z_uv, vv = s.felt.z_vv - t.felt.z_vv;
    const F skew = 0.5f * (uu - vv), turn = most(s.turn, t.turn);
    const F sharp = root(skew * skew + uv * uv) - 0.5f * (uu + vv);
    store(cells.overlap + n, overlap);
    store(cells.faded + n, faded);
    store(cells.bound + n, bound);
    store(cells.sharp + n, most(most(sharp, all(0)), turn * turn * (0.25f / task.width)));
    const I both = s.known & t.known;
    store(cells.s_z + n, known ? s.felt.z : (both ? task.s.outward * s.y : s_guess));
    store(cells.t_z + n, known ? t.felt.z : (both ? task.t.outward * t.y : t_guess));
    store(cells.s_u + n, known ? s.felt.z_u : task.s.outward * s.y_u);
    store(cells.s_v + n, known ? s.felt.z_v : task.s.outward * s.y_v);
    store(cells.t_u + n, known ? t.felt.z_u : task.t.outward * t.y_u);
    store(cells.t_v + n, known ? t.felt.z_v : task.t.outward * t.y_v);
    store(cells.t_uu + n, t.felt.z_uu), store(cells.t_uv + n, t.felt.z_uv), store(cells.t_vv + n, t.felt.z_vv);
  }
  return best;
}

}  // namespace
}  // namespace farfeel::penetration::simd

#include "haptic_core/penetration/simd_sums.inl"

namespace farfeel::penetration::simd {

const Kernels FARFEEL_KERNELS{look_at, add_up, FARFEEL_NAME};

}  // namespace farfeel::penetration::simd
