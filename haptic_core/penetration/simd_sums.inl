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

std::int32_t weigh(const WeightTask& task, const LaneCells& cells, std::int32_t* cell, std::int32_t* bin,
                   Weights& weights) {
  std::int32_t listed = 0, sampled = 0;
  I index;
  for (int k = 0; k < kLanes; ++k) index[k] = k;
  F known{}, near{}, at_edge{}, square{};
  for (int n = 0; n < task.count; n += kLanes) {
    const F slope_u = load(cells.s_u + n) - load(cells.t_u + n), slope_v = load(cells.s_v + n) - load(cells.t_v + n);
    const F spared = spared_by_slope(size_of(slope_u) * (task.step_u / task.width)) +
                     spared_by_slope(size_of(slope_v) * (task.step_v / task.width));
    const F bound = load(cells.bound + n) - task.width * spared;
    const I counts = bound >= task.lowest;
    const unsigned bits = bits_of(counts);
    if (bits == 0) continue;
    const F below = least(most((task.best - bound) * task.bins_per_m, all(0)), all(static_cast<float>(task.bins - 1)));
    push(cell + listed, index + n, bits), push(bin + listed, __builtin_convertvector(below, I), bits);
    listed += __builtin_popcount(bits);
    const F overlap = load(cells.overlap + n), faded = load(cells.faded + n);
    const I is_known = counts & (overlap > 0.99f * kNowhere);
    const F guessed = least(load(cells.s_z + n) - load(cells.t_z + n), all(task.best));
    const F at = is_known ? faded : guessed;
    const F p = counts & (at >= task.lowest) ? exponential((at - task.best) / task.width) : F{};
    const F near_p = at >= task.near ? p : F{}, sharp = load(cells.sharp + n);
    sampled += __builtin_popcount(bits_of(is_known & (at >= task.lowest)));
    known += is_known ? p : F{};
    near += near_p;
    at_edge += (~is_known | (faded < overlap - task.faded)) ? near_p : F{};
    square += near_p > all(0) ? near_p * sharp * sharp : F{};
  }
  weights = {sampled, total(known), total(near), total(at_edge), total(square)};
  return listed;
}

/// Weighted sums in vectors, and their totals.
struct Totals {
  F weight{}, edge{}, border{}, steep{}, point[3] = {}, gradient[5] = {}, square[15] = {}, curvature[15] = {};

  void add_to(Sums& sums) const {
    sums.weight += total(weight), sums.edge += total(edge), sums.border += total(border), sums.steep += total(steep);
    for (int k = 0; k < 3; ++k) sums.point[k] += total(point[k]);
    for (int k = 0; k < 5; ++k) sums.gradient[k] += total(gradient[k]);
    for (int k = 0; k < 15; ++k) sums.square[k] += total(square[k]), sums.curvature[k] += total(curvature[k]);
  }
};

/// Second derivative of the overlap at a point r = Q - To of T with slopes (z_u, z_v), as its negative: T's rise.
/// a and b are how far the point goes along u and v for each coordinate of T's motion.
inline void add_curvature(Totals& totals, F weight, const F r[3], F z_u, F z_v, const F bend[3]) {
  const F a[5] = {F{}, r[2], -r[1], all(1), F{}}, b[5] = {-r[2], F{}, r[0], F{}, all(1)};
  F carried[3][5];
  for (int k = 0; k < 5; ++k) {
    const F along = z_u * a[k] + z_v * b[k];
    carried[0][k] = -b[k] - z_v * along;
    carried[1][k] = a[k] + z_u * along;
    carried[2][k] = z_v * a[k] - z_u * b[k];
  }
  const F n[3] = {-z_u, -z_v, all(1)}, rn = r[0] * n[0] + r[1] * n[1] + r[2];
  int k = 0;
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j <= i; ++j, ++k) {
      F rise = bend[0] * a[i] * a[j] + bend[1] * (a[i] * b[j] + b[i] * a[j]) + bend[2] * b[i] * b[j];
      if (i < 3) rise += carried[i][j];
      if (j < 3) rise += carried[j][i];
      if (i < 3 && j < 3) rise += 0.5f * (r[i] * n[j] + n[i] * r[j]);
      if (i < 3 && i == j) rise -= rn;
      totals.curvature[k] -= weight * rise;
    }
  }
}

void add_up(const SumTask& task, const LaneCells& cells, Sums& sums) {
  Totals totals;
  for (int n = 0; n < task.count; n += kLanes) {
    const F overlap = load(cells.overlap + n);
    const I counts = overlap > task.level - 60 * task.width;
    if (bits_of(counts) == 0) continue;
    const F u = load(cells.u + n), v = load(cells.v + n);
    const Box box = box_of(u, v);
    const Fade s = fade_over(task.s, u, v, box, task.fade);
    const Fade t = fade_over(task.t, u, v, box, task.fade);
    const F keep = s.keep * t.keep;
    const F w = counts ? task.area * keep * exponential((overlap - task.level) / task.width) : F{};
    const F z = load(cells.t_z + n), z_u = load(cells.t_u + n), z_v = load(cells.t_v + n);
    const F r[3] = {u - task.To[0], v - task.To[1], z - task.To[2]};
    // -(r x N) and -N with N = (-z_u, -z_v, 1)
    F g[5] = {-(r[1] + r[2] * z_v), r[2] * z_u + r[0], r[0] * z_v - r[1] * z_u, z_u, z_v};
    F edge[5] = {};
    const F relative = t.slope / most(t.keep, all(1e-12f));
    if (t.is_near) {
      const F q[3] = {t.foot[0] - task.To[0], t.foot[1] - task.To[1], t.foot[2] - task.To[2]};
      edge[0] = q[2] * t.inward_v;
      edge[1] = -q[2] * t.inward_u;
      edge[2] = q[1] * t.inward_u - q[0] * t.inward_v;
      edge[3] = -t.inward_u;
      edge[4] = -t.inward_v;
      for (int k = 0; k < 5; ++k) g[k] += (task.width * relative) * edge[k];
    }
    totals.weight += w;
    totals.edge += keep < all(0.999f) ? w : F{};
    const I inner = (u >= task.low[0]) & (u <= task.high[0]) & (v >= task.low[1]) & (v <= task.high[1]);
    totals.border += inner ? F{} : w;
    const F s_u = load(cells.s_u + n), s_v = load(cells.s_v + n);
    totals.steep += most(s_u * s_u + s_v * s_v, z_u * z_u + z_v * z_v) > all(kSteepest * kSteepest) ? w : F{};
    const F p[3] = {u, v, z};
    for (int k = 0; k < 3; ++k) totals.point[k] += counts ? w * p[k] : F{};
    for (int k = 0; k < 5; ++k) totals.gradient[k] += counts ? w * g[k] : F{};
    if (!task.wants_hessian) continue;
    for (int i = 0, k = 0; i < 5; ++i) {
      for (int j = 0; j <= i; ++j, ++k) totals.square[k] += counts ? w * g[i] * g[j] : F{};
    }
    const F bend[3] = {load(cells.t_uu + n), load(cells.t_uv + n), load(cells.t_vv + n)};
    add_curvature(totals, w, r, z_u, z_v, bend);
    if (!t.is_near) continue;
    const F fading = w * task.width * (t.curvature / most(t.keep, all(1e-12f)) - relative * relative);
    for (int i = 0, k = 0; i < 5; ++i) {
      for (int j = 0; j <= i; ++j, ++k) totals.curvature[k] += t.keep > all(1e-6f) ? fading * edge[i] * edge[j] : F{};
    }
  }
  totals.add_to(sums);
}

}  // namespace
}  // namespace farfeel::penetration::simd
