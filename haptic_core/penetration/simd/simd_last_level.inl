// The last level of a search: cells are sampled and added up in one pass, and nothing is kept of them. Included by
// simd_kernels.inl.

namespace farfeel::penetration::simd {
namespace {

/// One side's felt surface over a group of cells, where any facet lies over the centre.
struct Felt {
  Height height;
  F coarse_y;
  I known;
};

[[gnu::always_inline]] inline void felt_over(const LaneSide& side, F u, F v, F guess_z, const Box& box, Touched& by,
                                             Felt& felt) {
  touched_by(side, u, v, {0, kOnEdge}, box, by);
  felt.known = by.felt >= I{};
  felt.coarse_y = by.coarse_y;
  bool is_first = true;
  for (int k = 0; k < by.count; ++k) {
    const I mine = by.felt == I{} + k;
    if (bits_of(mine) == 0) continue;
    const LaneChart& f = *by.charts[k];
    const Height h = height_over(f, u, v, start_over(f, by.coarse_z[k], guess_z), by.coarse_z[k], mine);
    if (is_first) {
      felt.height = h;
      is_first = false;
      continue;
    }
    felt.height.z = mine ? h.z : felt.height.z;
    felt.height.z_u = mine ? h.z_u : felt.height.z_u;
    felt.height.z_v = mine ? h.z_v : felt.height.z_v;
    felt.height.is_met = mine ? h.is_met : felt.height.is_met;
    felt.height.z_uu = mine ? h.z_uu : felt.height.z_uu;
    felt.height.z_uv = mine ? h.z_uv : felt.height.z_uv;
    felt.height.z_vv = mine ? h.z_vv : felt.height.z_vv;
  }
}

/// Steps longer than this, in widths of the fade, may miss it.
constexpr float kLongOfFade = 0.5f;

/// What the weights of a group tell; see weigh().
struct Judged {
  int sampled = 0;
  F near{}, at_edge{}, outermost{}, falling{}, square{};
  F least_way = all(kEndlessWay), least_near_way = all(kEndlessWay);
  F best = all(kNowhere);
};

inline void keep(CellStore& store, F faded, const Group& at, F s_z) {
  const unsigned bits = bits_of(faded >= store.lowest);
  if (bits == 0) return;
  if (store.count <= store.room - kLanes) {
    push(store.u + store.count, at.u, bits), push(store.v + store.count, at.v, bits);
    push(store.s_z + store.count, s_z, bits), push(store.t_z + store.count, at.z, bits);
    push(store.stands + store.count, at.stands, bits);
    store.count += __builtin_popcount(bits);
  } else {
    store.count = store.room + 1;
  }
}

inline void sample_and_add_group(const SumTask& task, const LaneCells& cells, int n, Touched& by, Totals& totals,
                                 Judged& judged, CellStore* store) {
  Group at;
  at.u = load(cells.u + n), at.v = load(cells.v + n), at.stands = load(cells.stands + n);
  const Box box = box_of(at.u, at.v);
  Felt s, t;
  felt_over(task.s, at.u, at.v, load(cells.s_z + n), box, by, s);
  if (bits_of(s.known) == 0) return;
  felt_over(task.t, at.u, at.v, load(cells.t_z + n), box, by, t);
  I known = s.known & t.known;
  if (bits_of(known) == 0) return;
  known &= (s.coarse_y + t.coarse_y <= task.deepest) & s.height.is_met & t.height.is_met;
  if (n + kLanes > task.count) {
    for (int k = task.count - n; k < kLanes; ++k) known[k] = 0;
  }
  at.overlap = known ? s.height.z - t.height.z : all(kNowhere);
  at.counts = at.overlap > task.level - 60 * task.width;
  if (bits_of(at.counts) == 0) return;
  at.z = t.height.z, at.z_u = t.height.z_u, at.z_v = t.height.z_v, at.s_u = s.height.z_u, at.s_v = s.height.z_v;
  at.bend[0] = t.height.z_uu, at.bend[1] = t.height.z_uv, at.bend[2] = t.height.z_vv;
  at.s = fade_over(task.s, at.u, at.v, box, task.fade);
  at.t = fade_over(task.t, at.u, at.v, box, task.fade);
  const F weight = add_group(task, at, totals);
  const F rise = most(all(task.nearer), task.level - task.tail + task.nearer - at.overlap);
  const F way = way_to_rise(rise, at.s_u, at.s_v, at.z_u, at.z_v);
  judged.least_way = at.counts ? least(judged.least_way, way) : judged.least_way;

  F faded = at.overlap;
  const bool is_fading = at.s.is_near || at.t.is_near;
  if (is_fading) faded = known ? at.overlap + task.width * logarithm(most(at.s.keep * at.t.keep, all(1e-20f))) : faded;
  judged.sampled += __builtin_popcount(bits_of(faded >= task.level - task.tail));
  if (store) keep(*store, faded, at, s.height.z);
  judged.best = most(judged.best, faded);
  const I is_near = faded >= task.level - task.near;
  if (bits_of(is_near) == 0) return;
  judged.least_near_way = is_near ? least(judged.least_near_way, way) : judged.least_near_way;
  const F p = is_near ? weight : F{};
  if (is_fading) judged.outermost += faded < at.overlap - task.outermost ? p : F{};
  if (task.step > kLongOfFade * task.fade) {
    // Few nodes may happen to lie in the fade: those in a band as wide as the step stand for it. All that weighs in a
    // band from the edge is its width less half of the fade.
    const float band = task.step > task.fade ? task.step : task.fade;
    const I beside =
        beside_edge(task.s, at.u, at.v, box, band, task.fade) | beside_edge(task.t, at.u, at.v, box, band, task.fade);
    judged.at_edge += beside ? p * (kFadesShare * task.fade / (band - 0.5f * task.fade)) : F{};
  } else if (is_fading) {
    judged.at_edge += faded < at.overlap - task.faded ? p : F{};
  }
  const F uu = s.height.z_uu - t.height.z_uu, uv = s.height.z_uv - t.height.z_uv, vv = s.height.z_vv - t.height.z_vv;
  const F skew = 0.5f * (uu - vv), slope_u = at.s_u - at.z_u, slope_v = at.s_v - at.z_v;
  const F bends = root(skew * skew + uv * uv) - 0.5f * (uu + vv);
  const F falls = (0.5f * task.per_width) * (slope_u * slope_u + slope_v * slope_v), sharp = most(bends, falls);
  judged.falling += falls > bends ? p : F{};
  judged.near += p;
  judged.square += is_near ? p * sharp * sharp : F{};
}

/// Fills the group that ends with cell count - 1 up with copies of it.
inline void pad(const LaneCells& cells, int count) {
  float* const columns[] = {cells.u, cells.v, cells.s_z, cells.t_z, cells.stands};
  for (float* const column : columns) {
    for (int k = count; k % kLanes != 0; ++k) column[k] = column[count - 1];
  }
}

float sample_and_add(const SumTask& task, const LaneCells& cells, Sums& sums, Weights& weights, CellStore* store) {
  pad(cells, task.count);
  Totals totals;
  Judged judged;
  Touched by;
  for (int n = 0; n < task.count; n += kLanes) sample_and_add_group(task, cells, n, by, totals, judged, store);
  totals.add_to(sums);
  weights = {judged.sampled,
             sums.weight / static_cast<double>(task.step * task.step),
             total(judged.near),
             total(judged.at_edge),
             total(judged.falling),
             total(judged.square),
             static_cast<double>(least_of(judged.least_way)),
             static_cast<double>(least_of(judged.least_near_way)),
             total(judged.outermost),
             0};
  return greatest_of(judged.best);
}

}  // namespace
}  // namespace farfeel::penetration::simd
