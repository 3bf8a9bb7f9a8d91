// The soft maximum's sums over cells, as soft_sum.cpp and pose_derivatives.cpp write them. Included by
// simd_kernels.inl.

namespace farfeel::penetration::simd {
namespace {

/// Across a cell whose overlap rises by x soft widths from side to side, the integral of its weight is less than that
/// of its bound everywhere: 1 / x of it if the rise is straight. If it is the flank of a crest instead, the bound
/// overshoots the crest by at least a quarter of x. In soft widths, the lesser of the two.
inline F spared_by_slope(F x) {
  return least(0.25f * x, logarithm(most(x, all(1))));
}

/// How far surfaces with these slopes go along each other, at least, until what is so far below the best matters; see
/// Seen.
inline F way_to_rise(F rise, F s_u, F s_v, F t_u, F t_v) {
  return rise / most(root(most(s_u * s_u + s_v * s_v, t_u * t_u + t_v * t_v)), all(kLevel));
}

std::int32_t weigh(const WeightTask& task, const LaneCells& cells, std::int32_t* cell, std::int32_t* bin,
                   Weights& weights) {
  std::int32_t listed = 0, sampled = 0;
  const float per_width = 1 / task.width;
  I index;
  for (int k = 0; k < kLanes; ++k) index[k] = k;
  F known{}, near{}, at_edge{}, in_fade{}, falling{}, square{}, least_way = all(kEndlessWay);
  for (int n = 0; n < task.count; n += kLanes) {
    const F slope_u = load(cells.s_u + n) - load(cells.t_u + n), slope_v = load(cells.s_v + n) - load(cells.t_v + n);
    const F spared = spared_by_slope(size_of(slope_u) * (task.step * per_width)) +
                     spared_by_slope(size_of(slope_v) * (task.step * per_width));
    const F bound = load(cells.bound + n) - task.width * spared;
    const I counts = bound >= task.lowest;
    const unsigned bits = bits_of(counts);
    if (bits != (1u << kLanes) - 1) {
      const F way = way_to_rise(task.best - task.safe - bound, load(cells.s_u + n), load(cells.s_v + n),
                                load(cells.t_u + n), load(cells.t_v + n));
      least_way = counts ? least_way : least(least_way, way);
    }
    if (bits == 0) continue;
    const F below = least(most((task.best - bound) * task.bins_per_m, all(0)), all(static_cast<float>(task.bins - 1)));
    push(cell + listed, index + n, bits), push(bin + listed, __builtin_convertvector(below, I), bits);
    listed += __builtin_popcount(bits);
    const F overlap = load(cells.overlap + n), faded = load(cells.faded + n);
    const I is_known = counts & (overlap > 0.99f * kNowhere);
    const F guessed = least(load(cells.s_z + n) - load(cells.t_z + n), all(task.best));
    const F at = is_known ? faded : guessed;
    const F p = (counts & (at >= task.lowest)) ? exponential((at - task.best) * per_width) : F{};
    const F near_p = at >= task.near ? p : F{}, sharp = load(cells.sharp + n);
    sampled += __builtin_popcount(bits_of(is_known & (at >= task.lowest)));
    known += is_known ? p : F{};
    near += near_p;
    const F fading_p = (is_known & (faded < overlap - task.faded)) ? near_p : F{};
    at_edge += is_known ? fading_p : near_p;
    in_fade += is_known ? fading_p : near_p * task.fades;
    falling += sharp < all(0) ? near_p : F{};
    square += near_p > all(0) ? near_p * sharp * sharp : F{};
  }
  weights = {sampled,
             total(known),
             total(near),
             total(at_edge),
             total(falling),
             total(square),
             static_cast<double>(least_of(least_way)),
             static_cast<double>(kEndlessWay),
             0,
             total(in_fade)};
  return listed;
}

/// Weighted sums in vectors, and their totals.
struct Totals {
  F weight{}, edge{}, border{}, steep{}, noise{}, squares{}, point[3] = {}, gradient[5] = {}, square[15] = {},
                                                             curvature[15] = {};

  void add_to(Sums& sums) const {
    sums.weight += total(weight), sums.edge += total(edge), sums.border += total(border), sums.steep += total(steep);
    sums.noise += total(noise), sums.squares += total(squares);
    for (int k = 0; k < 3; ++k) sums.point[k] += total(point[k]);
    for (int k = 0; k < 5; ++k) sums.gradient[k] += total(gradient[k]);
    for (int k = 0; k < 15; ++k) sums.square[k] += total(square[k]), sums.curvature[k] += total(curvature[k]);
  }
};

/// Second derivative of the overlap at a point r = Q - To of T with slopes (z_u, z_v), as its negative: T's rise. How
/// far the point goes for each coordinate of T's motion is (0, z, -y, 1, 0) along u, and (-z, 0, x, 0, 1) along v:
/// products with what is zero or one there are left out.
inline void add_curvature(Totals& totals, F weight, const F r[3], F z_u, F z_v, const F bend[3]) {
  const F x = r[0], y = r[1], z = r[2], along = z_v * x - z_u * y;
  const F carried[3][5] = {{z + z_v * z_v * z, -z_v * z_u * z, -x - z_v * along, -z_v * z_u, -1 - z_v * z_v},
                           {-z_u * z_v * z, z + z_u * z_u * z, z_u * along - y, 1 + z_u * z_u, z_u * z_v},
                           {z_u * z, z_v * z, -z_v * y - z_u * x, z_v, -z_u}};
  const F bent_u[5] = {-z * bend[1], z * bend[0], x * bend[1] - y * bend[0], bend[0], bend[1]};
  const F bent_v[5] = {-z * bend[2], z * bend[1], x * bend[2] - y * bend[1], bend[1], bend[2]};
  const F n[3] = {-z_u, -z_v, all(1)}, rn = r[0] * n[0] + r[1] * n[1] + r[2];
  int k = 0;
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i <= j; ++i, ++k) {
      const F by_bend[5] = {-z * bent_v[i], z * bent_u[i], x * bent_v[i] - y * bent_u[i], bent_u[i], bent_v[i]};
      F rise = by_bend[j];
      if (i < 3) rise += carried[i][j];
      if (j < 3) rise += carried[j][i] + 0.5f * (r[i] * n[j] + n[i] * r[j]);
      if (j < 3 && i == j) rise -= rn;
      totals.curvature[k] -= weight * rise;
    }
  }
}

/// How much of a cell's side lies between two ends.
inline F share_between(F at, float step, float low, float high) {
  const F from = most(at - 0.5f * step, all(low)), to = least(at + 0.5f * step, all(high));
  return most(to - from, all(0)) * (1 / step);
}

/// What is known over a group of cells, and which of them count.
struct Group {
  F u, v, overlap, z, z_u, z_v, s_u, s_v;  // T's height and slopes, S's slopes
  F bend[3];                               // T's
  F stands;
  I counts;
  Fade s, t;
};

/// Returns what the cells weigh against the level, without their area.
[[gnu::always_inline]] inline F add_group(const SumTask& task, const Group& at, Totals& totals) {
  const Fade& t = at.t;
  const bool is_fading = at.s.is_near || t.is_near;
  // What does not count may be no number.
  const auto counted = [&at](F x) { return at.counts ? x : F{}; };
  const F z = counted(at.z), z_u = counted(at.z_u), z_v = counted(at.z_v);
  F keep = all(1), p = exponential((at.overlap - task.level) * task.per_width);
  if (is_fading) keep = at.s.keep * t.keep, p *= keep;
  p = at.counts ? p : F{};
  F w = (task.step * task.step) * at.stands * p;
  const I is_inner = inside(task, at.u, at.v, -task.step);
  if (bits_of(~is_inner) != 0) {
    w *= share_between(at.u, task.step, task.low[0], task.high[0]) *
         share_between(at.v, task.step, task.low[1], task.high[1]);
    totals.border += is_inner ? F{} : w;
  }
  const F r[3] = {at.u - task.To[0], at.v - task.To[1], z - task.To[2]};
  // -(r x N) and -N with N = (-z_u, -z_v, 1)
  F g[5] = {-(r[1] + r[2] * z_v), r[2] * z_u + r[0], r[0] * z_v - r[1] * z_u, z_u, z_v};
  F edge[5] = {}, relative{};
  if (t.is_near) {
    relative = t.slope / most(t.keep, all(1e-12f));
    const F q[3] = {t.foot[0] - task.To[0], t.foot[1] - task.To[1], t.foot[2] - task.To[2]};
    edge[0] = q[2] * t.inward_v;
    edge[1] = -q[2] * t.inward_u;
    edge[2] = q[1] * t.inward_u - q[0] * t.inward_v;
    edge[3] = -t.inward_u;
    edge[4] = -t.inward_v;
    for (int k = 0; k < 5; ++k) g[k] += (task.width * relative) * edge[k];
  }
  totals.weight += w;
  totals.noise += w * w * (1 - 1 / at.stands);
  totals.squares += w * w;
  if (is_fading) totals.edge += keep < all(0.999f) ? w : F{};
  const F steepest = most(at.s_u * at.s_u + at.s_v * at.s_v, z_u * z_u + z_v * z_v);
  totals.steep += steepest > all(kSteepest * kSteepest) ? w : F{};
  const F point[3] = {at.u, at.v, z};
  for (int k = 0; k < 3; ++k) totals.point[k] += w * point[k];
  for (int k = 0; k < 5; ++k) totals.gradient[k] += w * g[k];
  if (!task.wants_hessian) return p;
  for (int i = 0, k = 0; i < 5; ++i) {
    for (int j = 0; j <= i; ++j, ++k) totals.square[k] += w * g[i] * g[j];
  }
  const F bend[3] = {counted(at.bend[0]), counted(at.bend[1]), counted(at.bend[2])};
  add_curvature(totals, w, r, z_u, z_v, bend);
  if (!t.is_near) return p;
  const F fading = w * task.width * (t.curvature / most(t.keep, all(1e-12f)) - relative * relative);
  for (int i = 0, k = 0; i < 5; ++i) {
    for (int j = 0; j <= i; ++j, ++k) totals.curvature[k] += t.keep > all(1e-6f) ? fading * edge[i] * edge[j] : F{};
  }
  return p;
}

void add_up(const SumTask& task, const LaneCells& cells, Sums& sums) {
  Totals totals;
  for (int n = 0; n < task.count; n += kLanes) {
    Group at;
    at.overlap = load(cells.overlap + n);
    at.counts = at.overlap > task.level - 60 * task.width;
    if (bits_of(at.counts) == 0) continue;
    at.u = load(cells.u + n), at.v = load(cells.v + n), at.stands = load(cells.stands + n);
    at.z = load(cells.t_z + n), at.z_u = load(cells.t_u + n), at.z_v = load(cells.t_v + n);
    at.s_u = load(cells.s_u + n), at.s_v = load(cells.s_v + n);
    at.bend[0] = load(cells.t_uu + n), at.bend[1] = load(cells.t_uv + n), at.bend[2] = load(cells.t_vv + n);
    const Box box = box_of(at.u, at.v);
    at.s = fade_over(task.s, at.u, at.v, box, task.fade);
    at.t = fade_over(task.t, at.u, at.v, box, task.fade);
    (void)add_group(task, at, totals);
  }
  totals.add_to(sums);
}

}  // namespace
}  // namespace farfeel::penetration::simd
