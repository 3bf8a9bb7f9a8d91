// Included by simd_plain.cpp, simd_avx2.cpp and simd_avx512.cpp after simd_lanes.inl. FARFEEL_KERNELS: the table's
// name.
//
// look_at: both sides are treated alike by measuring y = outward z, in which either surface's texture rises away from
// its own body: the overlap is d = y_S + y_T, felt is the greatest y, and only upward bends can hide a greater overlap
// between two samples. Over a cell of reach r around its centre, with g the slope there,
//   d <= y_S + y_T + |g_S + g_T| . half + (bend_S + bend_T) r^2 / 2
// where |g| . half, with half the cell's half sides, is how far a plane of slope g rises to a corner. Either side, or
// both, may stand in it as the plane above its relief, which has no bend: the least of the four bounds holds. So what
// is rough and low is bounded by its relief, while what it lies on, smooth and curved, is by its slope.
#include "haptic_core/penetration/simd/simd_fades.inl"
#include "haptic_core/penetration/simd/simd_heights.inl"

namespace farfeel::penetration::simd {
namespace {

constexpr float kSteepest = 2.7475f;  // slope of a surface that stands at 70 degrees
constexpr float kMostTurn = 3.5f;     // between slopes of a facet and its chart, either up to 60 degrees steep
constexpr float kOnEdge = 1e-8f;      // [m] cells this close outside still count: neighbours leave no gap

/// Half the side of a cell, and from its centre to a corner.
struct Half {
  float side, reach;

  [[nodiscard]] F rise(F slope_u, F slope_v) const { return (size_of(slope_u) + size_of(slope_v)) * side; }
};

/// Points in the window, grown by `more`.
template <class Task>
inline I inside(const Task& task, F u, F v, float more) {
  return (u >= all(task.low[0] - more)) & (u <= all(task.high[0] + more)) & (v >= all(task.low[1] - more)) &
         (v <= all(task.high[1] + more));
}

/// The facets of one side that touch a group of cells, together where one chart carries them.
struct Touched {
  const LaneChart* charts[kMostFacets];
  I touching[kMostFacets];
  F coarse_z[kMostFacets];  // of the facet that is felt at the centre, or else of one that touches
  F bend[kMostFacets];
  int count;
  F coarse_y;           // of the felt facet's plane at the centre
  F lowest_y;           // of any touching facet's plane at the centre
  I felt;               // index of the chart felt at the centre, -1 without
  I touched;            // any
  F top, top_u, top_v;  // a plane above everything felt in the cell, as its height at the centre and its slope
  float steepest, chart_steepest, spare;  // of the facets
};

/// Where Newton begins. A chart that leans much may meet a ray more than once: there every ray starts at the coarse
/// facet, as in the reference, so that what it finds depends on the pose alone and not on how the search came by.
inline F start_over(const LaneChart& f, F coarse_z, F guess_z) {
  if (f.tilt > kAskew) return coarse_z;
  return guess_z == guess_z ? guess_z : coarse_z + 0.5f * (f.reach_up + f.reach_down);
}

/// Adds a facet that touches; returns the index of its chart.
inline int add_facet(Touched& by, const LaneSide& side, const LaneFacet& facet, I touches, F z) {
  const LaneChart& f = side.charts[facet.chart];
  for (int k = 0; k < by.count; ++k) {
    if (by.charts[k] != &f) continue;
    by.coarse_z[k] = by.touching[k] ? by.coarse_z[k] : z;
    by.touching[k] |= touches;
    return k;
  }
  by.charts[by.count] = &f;
  by.coarse_z[by.count] = z;
  by.touching[by.count] = touches;
  return by.count++;
}

/// Which of the kLanes facets from `first` on may come into a circle: a bit each.
inline unsigned reaching(const LaneSide& side, int first, float u, float v, float radius) {
  I reaches = I{} - 1;
  for (const LaneLines& edge : side.facet_edges) {
    reaches &=
        load(edge.constant + first) + load(edge.per_u + first) * u + load(edge.per_v + first) * v >= all(-radius);
  }
  return bits_of(reaches);
}

inline void touched_by(const LaneSide& side, F u, F v, const Half& half, const Box& box, Touched& by) {
  by.count = 0;
  // Here until all facets are seen: through `by` each of them would store and load again.
  F coarse_y = all(kNowhere), lowest_y = all(-kNowhere);
  I felt = I{} - 1, touched{};
  const float wide = box.high[0] - box.low[0], high = box.high[1] - box.low[1];
  const float middle_u = 0.5f * (box.low[0] + box.high[0]), middle_v = 0.5f * (box.low[1] + box.high[1]);
  const float radius = 0.5f * __builtin_sqrtf(wide * wide + high * high) + half.reach + kOnEdge;
  for (int first = 0; first < side.facet_boxes.count; first += kLanes) {
    unsigned near = meeting(side.facet_boxes, first, box, half.reach);
    if (near != 0) near &= reaching(side, first, middle_u, middle_v, radius);
    for (; near != 0 && by.count < kMostFacets; near &= near - 1) {
      const LaneFacet& f = side.facets[first + __builtin_ctz(near)];
      F inside = f.inside[0][0] + f.inside[0][1] * u + f.inside[0][2] * v;
      for (int k = 1; k < 3; ++k) inside = least(inside, f.inside[k][0] + f.inside[k][1] * u + f.inside[k][2] * v);
      const I touches = inside >= -half.reach;
      if (bits_of(touches) == 0) continue;
      const F z = f.plane[0] + f.plane[1] * u + f.plane[2] * v, y = side.outward * z;
      const int k = add_facet(by, side, f, touches, z);
      const I wins = (inside >= -kOnEdge) & (y > coarse_y);
      coarse_y = wins ? y : coarse_y;
      by.coarse_z[k] = wins ? z : by.coarse_z[k];
      felt = wins ? I{} + k : felt;
      lowest_y = (touches & (y < lowest_y)) ? y : lowest_y;
      touched |= touches;
    }
  }
  by.coarse_y = coarse_y, by.lowest_y = lowest_y, by.felt = felt, by.touched = touched;
}

/// Bounds by relief: fills top and bend.
inline void limit_by(const LaneSide& side, F u, F v, F guess_z, const Half& half, Touched& by) {
  I known{};
  by.top = all(-kNowhere);
  by.top_u = by.top_v = F{};
  by.steepest = by.chart_steepest = 0;
  by.spare = kEndlessWay;
  for (int k = 0; k < by.count; ++k) {
    const LaneChart& f = *by.charts[k];
    by.steepest = f.most_slope > by.steepest ? f.most_slope : by.steepest;
    by.chart_steepest = f.plane_slope > by.chart_steepest ? f.plane_slope : by.chart_steepest;
    by.spare = f.heights && f.spare < by.spare ? f.spare : by.spare;
    const Limit limit = limit_over(f, u, v, start_over(f, by.coarse_z[k], guess_z), by.coarse_z[k]);
    by.bend[k] = limit.bend;
    const F top = side.outward * limit.top;
    const float top_u = side.outward * f.plane[1], top_v = side.outward * f.plane[2];
    if (k == 0) {
      by.top = top, by.top_u = all(top_u), by.top_v = all(top_v);
      known = by.touching[0];
      continue;
    }
    const I is_first = by.touching[k] & ~known, again = by.touching[k] & known;
    const F raised = most(by.top, top + half.rise(top_u - by.top_u, top_v - by.top_v));
    by.top = is_first ? top : (again ? raised : by.top);
    by.top_u = is_first ? all(top_u) : by.top_u;
    by.top_v = is_first ? all(top_v) : by.top_v;
    known |= by.touching[k];
  }
}

/// One side's felt surface over a group of cells.
struct Side {
  Height felt;          // at the centre, by the facet that is felt there
  F y, y_u, y_v, bend;  // bounds everything felt in the cell
  F turn;               // greatest difference of slopes between charts of the cell
  I several;            // where it is made of more than one chart
  I known;              // where any facet touches
};

inline void side_over(const LaneSide& side, const Touched& by, I wanted, F u, F v, F guess_z, const Half& half,
                      Side& over) {
  over.known = over.several = I{};
  over.turn = F{};
  for (int k = 0; k < by.count; ++k) {
    const I near = by.touching[k] & wanted;
    if (bits_of(near) == 0) continue;
    const LaneChart& f = *by.charts[k];
    const Height h = height_over(f, u, v, start_over(f, by.coarse_z[k], guess_z), by.coarse_z[k], near);
    const F stretch = 1 + f.tilt * (size_of(h.z_u) + size_of(h.z_v));
    F bend = by.bend[k] * stretch * stretch;
    F y = side.outward * h.z, y_u = side.outward * h.z_u, y_v = side.outward * h.z_v;
    if (bits_of(near & ~h.is_met) != 0) {
      // Where the ray passes the texture by, its slope there is nobody's, and may be any: all that is known is how far
      // the texture may rise above the facet's plane, which the chart's plane is not much steeper than.
      const float rises = (side.outward > 0 ? f.reach_up : -f.reach_down) + kMostTurn * half.reach;
      y = h.is_met ? y : side.outward * by.coarse_z[k] + rises;
      y_u = h.is_met ? y_u : all(side.outward * f.plane[1]), y_v = h.is_met ? y_v : all(side.outward * f.plane[2]);
      bend = h.is_met ? bend : F{};
    }
    if (bits_of(over.known) == 0) {
      over.felt = h;
      over.y = y, over.y_u = y_u, over.y_v = y_v, over.bend = bend;
      over.known = near;
      continue;
    }
    const I mine = by.felt == I{} + k, is_first = near & ~over.known, again = near & over.known;
    const I takes = mine | is_first;
    over.several |= again;
    over.felt.z = takes ? h.z : over.felt.z;
    over.felt.z_u = takes ? h.z_u : over.felt.z_u;
    over.felt.z_v = takes ? h.z_v : over.felt.z_v;
    over.felt.z_uu = takes ? h.z_uu : over.felt.z_uu;
    over.felt.z_uv = takes ? h.z_uv : over.felt.z_uv;
    over.felt.z_vv = takes ? h.z_vv : over.felt.z_vv;
    over.felt.is_met = takes ? h.is_met : over.felt.is_met;
    const F du = y_u - over.y_u, dv = y_v - over.y_v;
    over.turn = again ? most(over.turn, root(du * du + dv * dv)) : over.turn;
    over.y = is_first ? y : (again ? most(over.y, y + half.rise(du, dv)) : over.y);
    over.y_u = is_first ? y_u : over.y_u;
    over.y_v = is_first ? y_v : over.y_v;
    over.bend = is_first ? bend : (again ? most(over.bend, bend) : over.bend);
    over.known |= near;
  }
}

/// What both sides are made of over a group of cells, and a bound by their relief.
struct Outline {
  Touched s, t;
  F bound;
  I shared;  // where both sides are felt, and not certainly another layer
  I wanted;
};

/// False where nothing is shared.
inline bool outline_over(const CellTask& task, F u, F v, F s_guess, F t_guess, const Box& box, const Half& half,
                         Outline& over) {
  touched_by(task.s, u, v, half, box, over.s);
  if (over.s.count == 0) return false;
  touched_by(task.t, u, v, half, box, over.t);
  over.shared = over.s.touched & over.t.touched & (over.s.lowest_y + over.t.lowest_y <= task.deepest + 2 * half.reach);
  if (bits_of(over.shared) == 0) return false;
  limit_by(task.s, u, v, s_guess, half, over.s);
  limit_by(task.t, u, v, t_guess, half, over.t);
  over.bound = over.s.top + over.t.top + half.rise(over.s.top_u + over.t.top_u, over.s.top_v + over.t.top_v);
  return true;
}

/// A group of cells: where they are, and what is guessed of the heights there.
struct Cells {
  F u, v, s_guess, t_guess, stands;
};

inline Cells cells_at(const LaneCells& cells, int n) {
  return {load(cells.u + n), load(cells.v + n), load(cells.s_z + n), load(cells.t_z + n), load(cells.stands + n)};
}

constexpr float kLeastBow = 1e-20f;  // that differs from its negative
constexpr float kLevel = 1e-3f;      // slope that no surface is below: a way is no division by zero

/// Which cells of a group count and may be lifted to best - tail, as bits. Fills the group's outline. What one side
/// leaves by moving on, the other's slope makes up for: so the steeper one says how soon the others matter.
inline unsigned sifted(const CellTask& task, const Cells& at, float best, Outline& over, F& least_way) {
  const Half half{task.half, task.reach};
  if (!outline_over(task, at.u, at.v, at.s_guess, at.t_guess, box_of(at.u, at.v), half, over)) return 0;
  const I reaches = over.bound >= best - task.tail;
  over.wanted = over.shared & reaches & inside(task, at.u, at.v, half.side);
  // They rise by their own slopes, or, as far as the bounds hold beyond the cell, by their charts'.
  const auto steeper = [](float a, float b) { return a > kLevel || b > kLevel ? (a > b ? a : b) : kLevel; };
  const F rise = best - task.safe - over.bound;
  const float spare = over.s.spare < over.t.spare ? over.s.spare : over.t.spare;
  const F way = most(rise * (1 / steeper(over.s.steepest, over.t.steepest)),
                     least(rise * (1 / steeper(over.s.chart_steepest, over.t.chart_steepest)), all(spare)));
  least_way = over.shared & ~reaches ? least(least_way, way) : least_way;
  return bits_of(over.wanted);
}

Seen sift(const CellTask& task, const LaneCells& cells) {
  Outline over;
  int kept = 0;
  F least_way = all(kEndlessWay);
  for (int n = 0; n < task.count; n += kLanes) {
    const Cells at = cells_at(cells, n);
    unsigned bits = sifted(task, at, task.best, over, least_way);
    if (n + kLanes > task.count) bits &= (1u << (task.count - n)) - 1;
    if (bits == 0) continue;
    push(cells.u + kept, at.u, bits), push(cells.v + kept, at.v, bits);
    push(cells.s_z + kept, at.s_guess, bits), push(cells.t_z + kept, at.t_guess, bits);
    push(cells.stands + kept, at.stands, bits);
    kept += __builtin_popcount(bits);
  }
  return {task.best, kept, least_of(least_way)};
}

/// Samples the wanted cells of a group, and notes them from place n on. Returns the greatest overlap seen, at least
/// best.
inline float sample_group(const CellTask& task, const LaneCells& cells, int n, const Cells& at, float best,
                          const Outline& by) {
  const Half half{task.half, task.reach};
  const float r = half.reach;
  const F u = at.u, v = at.v, s_guess = at.s_guess, t_guess = at.t_guess;
  const I wanted = by.wanted;
  const Box box = box_of(u, v);
  Side s, t;
  side_over(task.s, by.s, wanted, u, v, s_guess, half, s);
  side_over(task.t, by.t, wanted, u, v, t_guess, half, t);
  const F s_bow = (0.5f * r * r) * s.bend, t_bow = (0.5f * r * r) * t.bend, bow = s_bow + t_bow;
  const F by_samples = s.y + t.y + half.rise(s.y_u + t.y_u, s.y_v + t.y_v) + bow;
  const F by_relief_of_s = by.s.top + t.y + half.rise(by.s.top_u + t.y_u, by.s.top_v + t.y_v) + t_bow;
  const F by_relief_of_t = s.y + by.t.top + half.rise(s.y_u + by.t.top_u, s.y_v + by.t.top_v) + s_bow;
  F bound = wanted ? least(least(by.bound, by_samples), least(by_relief_of_s, by_relief_of_t)) : all(kNowhere);
  const I known = wanted & (by.s.felt >= I{}) & (by.t.felt >= I{}) & (by.s.coarse_y + by.t.coarse_y <= task.deepest) &
                  s.felt.is_met & t.felt.is_met & inside(task, u, v, 0);
  const F overlap = known ? s.felt.z - t.felt.z : all(kNowhere);
  F faded = overlap;
  const Fade s_fade = fade_over(task.s, u, v, box, task.fade), t_fade = fade_over(task.t, u, v, box, task.fade);
  if (s_fade.is_near || t_fade.is_near) {
    const F keep = most(s_fade.keep * t_fade.keep, all(1e-20f));
    const F most_keep = most_kept(s_fade, task.fade, r) * most_kept(t_fade, task.fade, r);
    faded = known ? overlap + task.width * logarithm(keep) : overlap;
    bound = wanted ? bound + task.width * logarithm(most_keep) : bound;
  }
  // Greatest eigenvalue of minus the overlap's second derivative; a crease counts as what it is over the soft width,
  // and so does the slope, for where an edge cuts a peak off.
  const F uu = s.felt.z_uu - t.felt.z_uu, uv = s.felt.z_uv - t.felt.z_uv, vv = s.felt.z_vv - t.felt.z_vv;
  const F skew = 0.5f * (uu - vv), turn = most(s.turn, t.turn), slope_u = s.y_u + t.y_u, slope_v = s.y_v + t.y_v;
  const F sharp = known ? root(skew * skew + uv * uv) - 0.5f * (uu + vv) : F{};
  const F steep = (0.5f * task.per_width) * (slope_u * slope_u + slope_v * slope_v + 0.5f * turn * turn);
  store(cells.u + n, u), store(cells.v + n, v), store(cells.stands + n, at.stands);
  store(cells.overlap + n, overlap);
  store(cells.faded + n, faded);
  store(cells.bound + n, bound);
  store(cells.sharp + n, steep > sharp ? -steep : sharp);
  const I both = s.known & t.known;
  store(cells.bow + n, both ? (s.several | t.several ? -most(bow, all(kLeastBow)) : bow) : all(kNowhere));
  store(cells.s_z + n, known ? s.felt.z : (both ? task.s.outward * s.y : s_guess));
  store(cells.t_z + n, known ? t.felt.z : (both ? task.t.outward * t.y : t_guess));
  store(cells.s_u + n, known ? s.felt.z_u : task.s.outward * s.y_u);
  store(cells.s_v + n, known ? s.felt.z_v : task.s.outward * s.y_v);
  store(cells.t_u + n, known ? t.felt.z_u : task.t.outward * t.y_u);
  store(cells.t_v + n, known ? t.felt.z_v : task.t.outward * t.y_v);
  store(cells.t_uu + n, t.felt.z_uu), store(cells.t_uv + n, t.felt.z_uv), store(cells.t_vv + n, t.felt.z_vv);
  const float greatest = greatest_of(faded);
  return greatest > best ? greatest : best;
}

/// Cells of groups of which few are wanted, until they fill a group of their own.
struct Waiting {
  float u[2 * kLanes], v[2 * kLanes], s_guess[2 * kLanes], t_guess[2 * kLanes], stands[2 * kLanes];
  int count = 0;

  void add(const Cells& at, unsigned bits) {
    push(u + count, at.u, bits), push(v + count, at.v, bits);
    push(s_guess + count, at.s_guess, bits), push(t_guess + count, at.t_guess, bits);
    push(stands + count, at.stands, bits);
    count += __builtin_popcount(bits);
  }
  Cells take() {
    count -= kLanes;
    return {load(u + count), load(v + count), load(s_guess + count), load(t_guess + count), load(stands + count)};
  }
};

Seen look_at(const CellTask& task, const LaneCells& cells) {
  constexpr int kMany = kLanes / 2;  // of a group: they are sampled where they are
  float best = task.best;
  int noted = 0;
  Outline over;
  Waiting waiting;
  F least_way = all(kEndlessWay);
  for (int n = 0; n < task.count; n += kLanes) {
    const Cells at = cells_at(cells, n);
    unsigned bits = sifted(task, at, best, over, least_way);
    if (n + kLanes > task.count) bits &= (1u << (task.count - n)) - 1;
    if (bits == 0) continue;
    if (__builtin_popcount(bits) >= kMany) {
      for (int k = task.count - n; k < kLanes; ++k) over.wanted[k] = 0;
      best = sample_group(task, cells, noted, at, best, over);
      noted += kLanes;
      continue;
    }
    waiting.add(at, bits);
    if (waiting.count < kLanes) continue;
    const Cells those = waiting.take();
    if (sifted(task, those, best, over, least_way) == 0) continue;
    best = sample_group(task, cells, noted, those, best, over);
    noted += kLanes;
  }
  if (const int left = waiting.count; left > 0) {
    const float far[4] = {waiting.u[0], waiting.v[0], waiting.s_guess[0], waiting.t_guess[0]};
    for (int k = left; k < kLanes; ++k) {
      waiting.u[k] = far[0], waiting.v[k] = far[1], waiting.s_guess[k] = far[2], waiting.t_guess[k] = far[3];
      waiting.stands[k] = 1;
    }
    waiting.count = kLanes;
    const Cells those = waiting.take();
    if (sifted(task, those, best, over, least_way) != 0) {
      for (int k = left; k < kLanes; ++k) over.wanted[k] = 0;
      best = sample_group(task, cells, noted, those, best, over);
      noted += left;
    }
  }
  return {best, noted, least_of(least_way)};
}

}  // namespace
}  // namespace farfeel::penetration::simd

#include "haptic_core/penetration/simd/simd_sums.inl"

#include "haptic_core/penetration/simd/simd_last_level.inl"

#include "haptic_core/penetration/simd/simd_lattice.inl"

#include "haptic_core/penetration/simd/simd_feet.inl"

namespace farfeel::penetration::simd {

const Kernels FARFEEL_KERNELS{sift,           look_at,     lay,  weigh,    add_up,
                              sample_and_add, sift_facets, feel, add_feet, FARFEEL_NAME};

}  // namespace farfeel::penetration::simd
