// Included by simd_plain.cpp, simd_avx2.cpp and simd_avx512.cpp, which differ in the width of F and in gather().
// FARFEEL_LANES: floats in a vector. FARFEEL_KERNELS: the name of the table.
#include "haptic_core/penetration/simd_kernels.h"

namespace farfeel::penetration::simd {
namespace {

constexpr int kLanes = FARFEEL_LANES;
typedef float F __attribute__((vector_size(4 * kLanes), aligned(4), may_alias));
typedef std::int32_t I __attribute__((vector_size(4 * kLanes)));

constexpr float kLeastSlope = 0.05f;
constexpr float kSteepest = 2.7475f;  // slope of a surface that stands at 70 degrees
// How much the chart leans decides how often parallax needs another look. Newton leaves a lateral error of about
// curvature (tilt x height)^2 / 2: at 0.1 and 0.2 mm, half a micrometre after one look and nothing after two.
constexpr float kUpright = 0.1f, kAskew = 0.3f;
constexpr int kStepsToMeet = 2;  // fewer only find cells: then a ray counts as met if it is on its way
constexpr float kMet = 3e-6f, kMetLoosely = 0.3e-3f;  // [m] the last step, across the chart or past the relief
constexpr float kOnEdge = 1e-8f;  // [m] nodes this close outside still count: neighbours leave no gap

inline F all(float x) {
  return F{} + x;
}
inline F load(const float* p) {
  return *reinterpret_cast<const F*>(p);
}
inline void store(float* p, F x) {
  *reinterpret_cast<F*>(p) = x;
}
inline F least(F a, F b) {
  return a < b ? a : b;
}
inline F most(F a, F b) {
  return a > b ? a : b;
}
inline F size_of(F x) {
  return x < all(0) ? -x : x;
}
inline bool any(I mask) {
  std::int32_t bits = 0;
  for (int k = 0; k < kLanes; ++k) bits |= mask[k];
  return bits != 0;
}
inline F root(F x) {
  F y;
  for (int k = 0; k < kLanes; ++k) y[k] = __builtin_sqrtf(x[k]);
  return y;
}
inline double total(F x) {
  double sum = 0;
  for (int k = 0; k < kLanes; ++k) sum += static_cast<double>(x[k]);
  return sum;
}

/// e^x within 3e-7 relative for -80 <= x <= 80: 2^n by its bits, the rest by Taylor on |r| <= ln 2 / 2.
inline F exponential(F x) {
  x = least(most(x, all(-80)), all(80));
  const F scaled = x * 1.44269504f;
  const I n = __builtin_convertvector(scaled + (scaled < all(0) ? all(-0.5f) : all(0.5f)), I);
  const F nf = __builtin_convertvector(n, F);
  const F r = (x - nf * 0.693359375f) + nf * 2.12194440e-4f;
  const F p =
      1 + r * (1 + r * (0.5f + r * (1.6666667e-1f + r * (4.1666667e-2f + r * (8.3333333e-3f + r * 1.3888889e-3f)))));
  const I power = (n + 127) << 23;
  return p * reinterpret_cast<const F&>(power);
}

struct Height {
  F z, z_u, z_v;
  I is_met;  // false where the ray passes the texture by
};

/// The felt surface over (u, v), by Newton along the ray from the coarse triangle; see facing_patch.cpp.
inline Height height_over(const LaneFacet& f, F u, F v, F z, int steps) {
  if (!f.heights) return {z, all(f.plane[1]), all(f.plane[2]), I{} - 1};
  const F lowest = z + f.reach_down, highest = z + f.reach_up;
  const float met_limit = steps < kStepsToMeet ? kMetLoosely : kMet;
  if (f.tilt < kUpright) --steps;
  if (f.tilt > kAskew) steps *= 2;
  const F coarse_z = z;
  I met = I{} - 1;
  F h_s{}, h_t{}, G_z = all(1);
  for (int step = 0; step <= steps; ++step) {
    F at[3];
    for (int k = 0; k < 3; ++k) at[k] = f.to_H[k][0] + f.to_H[k][1] * u + f.to_H[k][2] * v + f.to_H[k][3] * z;
    const F s = least(most(at[0], all(0)), all(static_cast<float>(f.columns)));
    const F t = least(most(at[1], all(0)), all(static_cast<float>(f.rows)));
    I i = __builtin_convertvector(s, I), j = __builtin_convertvector(t, I);
    i = i < f.columns - 1 ? i : I{} + (f.columns - 1);
    j = j < f.rows - 1 ? j : I{} + (f.rows - 1);
    const F x = s - __builtin_convertvector(i, F) - 0.5f, y = t - __builtin_convertvector(j, F) - 0.5f;
    const F xa = 0.5f - x, xb = 0.5f + x, ya = 0.5f - y, yb = 0.5f + y;
    const F wx[3] = {0.5f * xa * xa, 0.75f - x * x, 0.5f * xb * xb};
    const F wy[3] = {0.5f * ya * ya, 0.75f - y * y, 0.5f * yb * yb};
    const F sy[3] = {-ya, -2 * y, yb};
    F value{}, along_s{}, along_t{};
    I index = j * f.stride + i;
    for (int row = 0; row < 3; ++row, index += f.stride) {
      // Two coefficients a load, the lower one first.
      const I pair = gather(f.heights, index), third = gather(f.heights, index + 2);
      const F c0 = __builtin_convertvector(pair & 0xFFFF, F), c1 = __builtin_convertvector((pair >> 16) & 0xFFFF, F);
      const F c2 = __builtin_convertvector(third & 0xFFFF, F);
      const F in_row = c0 * wx[0] + c1 * wx[1] + c2 * wx[2];
      value += wy[row] * in_row;
      along_t += sy[row] * in_row;
      along_s += wy[row] * (c2 * xb - c1 * (2 * x) - c0 * xa);
    }
    h_s = along_s * (f.scale * f.texels_per_m);
    h_t = along_t * (f.scale * f.texels_per_m);
    G_z = f.axes[2][2] - h_s * f.axes[2][0] - h_t * f.axes[2][1];
    G_z = f.toward * G_z > kLeastSlope ? G_z : all(f.toward * kLeastSlope);
    const F next = z - (at[2] - (f.offset + f.scale * value)) / G_z;
    const F held = least(most(next, lowest), highest);
    met = (size_of(held - next) < met_limit) & (size_of(next - z) * f.tilt < met_limit);
    z = held;
  }
  met &= size_of(z - coarse_z) * f.tilt <= f.most_drift;
  return {z, -(f.axes[0][2] - h_s * f.axes[0][0] - h_t * f.axes[0][1]) / G_z,
          -(f.axes[1][2] - h_s * f.axes[1][0] - h_t * f.axes[1][1]) / G_z, met};
}

/// What a patch's coarse triangles say over a group of nodes: the felt facet of each, and its plane.
struct Coarse {
  int facets[kMostFacets];
  int count = 0;
  F z;
  I felt;     // index into facets
  I covered;  // mask
};

inline Coarse coarse_over(const LaneFacet* facets, int count, float outward, F u, F v, const float low[2],
                          const float high[2]) {
  Coarse coarse;
  coarse.z = all(outward * kNowhere);
  coarse.felt = I{} - 1;
  coarse.covered = I{};
  for (int i = 0; i < count && coarse.count < kMostFacets; ++i) {
    const LaneFacet& f = facets[i];
    if (f.low[0] > high[0] || f.high[0] < low[0] || f.low[1] > high[1] || f.high[1] < low[1]) continue;
    I inside = I{} - 1;
    for (int k = 0; k < 3; ++k) inside &= f.inside[k][0] + f.inside[k][1] * u + f.inside[k][2] * v >= -kOnEdge;
    const F z = f.plane[0] + f.plane[1] * u + f.plane[2] * v;
    const I wins = inside & (outward * z > outward * coarse.z);
    if (!any(wins)) continue;
    coarse.z = wins ? z : coarse.z;
    coarse.felt = wins ? I{} + coarse.count : coarse.felt;
    coarse.covered |= inside;
    coarse.facets[coarse.count++] = i;
  }
  return coarse;
}

inline Height felt_over(const LaneFacet* facets, const Coarse& coarse, F u, F v, int steps) {
  Height felt{coarse.z, F{}, F{}, I{}};
  for (int k = 0; k < coarse.count; ++k) {
    const I mine = coarse.felt == I{} + k;
    if (!any(mine)) continue;
    const Height h = height_over(facets[coarse.facets[k]], u, v, coarse.z, steps);
    felt.z = mine ? h.z : felt.z;
    felt.z_u = mine ? h.z_u : felt.z_u;
    felt.z_v = mine ? h.z_v : felt.z_v;
    felt.is_met |= mine & h.is_met;
  }
  return felt;
}

void overlaps_at(const OverlapTask& task, const LaneOverlaps& out) {
  float best = kNowhere;
  for (int n = 0; n < task.count; n += kLanes) {
    const F u = load(task.u + n), v = load(task.v + n);
    F overlap = all(kNowhere);
    float low[2] = {u[0], v[0]}, high[2] = {u[0], v[0]};
    for (int k = 1; k < kLanes; ++k) {
      low[0] = u[k] < low[0] ? u[k] : low[0], high[0] = u[k] > high[0] ? u[k] : high[0];
      low[1] = v[k] < low[1] ? v[k] : low[1], high[1] = v[k] > high[1] ? v[k] : high[1];
    }
    const Coarse s = coarse_over(task.s, task.s_count, 1, u, v, low, high);
    if (s.count == 0) {
      store(out.overlap + n, overlap);
      continue;
    }
    const Coarse t = coarse_over(task.t, task.t_count, -1, u, v, low, high);
    const F coarse = s.z - t.z;
    const I both = s.covered & t.covered & (coarse <= task.deepest);
    float up = -1e30f, down = 1e30f;
    for (int k = 0; k < s.count; ++k) up = task.s[s.facets[k]].reach_up > up ? task.s[s.facets[k]].reach_up : up;
    for (int k = 0; k < t.count; ++k)
      down = task.t[t.facets[k]].reach_down < down ? task.t[t.facets[k]].reach_down : down;
    if (!any(both & (coarse + (up - down) >= best - task.margin))) {
      store(out.overlap + n, overlap);
      continue;
    }
    const Height top = felt_over(task.s, s, u, v, task.steps), bottom = felt_over(task.t, t, u, v, task.steps);
    overlap = (both & top.is_met & bottom.is_met) ? top.z - bottom.z : overlap;
    for (int k = 0; k < kLanes; ++k) best = overlap[k] > best ? overlap[k] : best;
    store(out.overlap + n, overlap);
    store(out.s_u + n, top.z_u), store(out.s_v + n, top.z_v);
    store(out.t_z + n, bottom.z), store(out.t_u + n, bottom.z_u), store(out.t_v + n, bottom.z_v);
  }
}

/// Fade near a patch's own edge; see facing_patch.cpp.
struct Fade {
  F keep, slope, inward_u, inward_v, foot[3];
};

inline Fade fade_over(const LaneEdge* edges, int count, F u, F v, const float low[2], const float high[2],
                      float width) {
  F square = all(width * width);
  Fade fade{all(1), F{}, F{}, F{}, {F{}, F{}, F{}}};
  I is_near = I{};
  for (int i = 0; i < count; ++i) {
    const LaneEdge& e = edges[i];
    if (e.low[0] > high[0] || e.high[0] < low[0] || e.low[1] > high[1] || e.high[1] < low[1]) continue;
    const F share = least(most(((u - e.a[0]) * e.along[0] + (v - e.a[1]) * e.along[1]) * e.per_square, all(0)), all(1));
    const F du = u - e.a[0] - share * e.along[0], dv = v - e.a[1] - share * e.along[1];
    const F far = du * du + dv * dv;
    const I nearer = far < square;
    square = nearer ? far : square;
    is_near |= nearer;
    fade.inward_u = nearer ? du : fade.inward_u;
    fade.inward_v = nearer ? dv : fade.inward_v;
    for (int k = 0; k < 3; ++k) fade.foot[k] = nearer ? e.a[k] + share * e.along[k] : fade.foot[k];
  }
  if (!any(is_near)) return fade;
  const F distance = most(root(square), all(1e-9f)), x = distance / width;
  fade.keep = is_near ? x * x * (3 - 2 * x) : all(1);
  fade.slope = is_near ? 6 * x * (1 - x) / width : F{};
  fade.inward_u /= distance;
  fade.inward_v /= distance;
  return fade;
}

void add_up(const SumTask& task, const LaneOverlaps& at, Sums& sums) {
  F weight{}, edge{}, border{}, steep{}, point[3] = {}, gradient[5] = {};
  for (int n = 0; n < task.count; n += kLanes) {
    const F overlap = load(at.overlap + n);
    const I counts = overlap > task.level - 60 * task.width;
    if (!any(counts)) continue;
    const F u = load(task.u + n), v = load(task.v + n), area = load(task.area + n);
    float low[2] = {u[0], v[0]}, high[2] = {u[0], v[0]};
    for (int k = 1; k < kLanes; ++k) {
      low[0] = u[k] < low[0] ? u[k] : low[0], high[0] = u[k] > high[0] ? u[k] : high[0];
      low[1] = v[k] < low[1] ? v[k] : low[1], high[1] = v[k] > high[1] ? v[k] : high[1];
    }
    const Fade s = fade_over(task.s, task.s_count, u, v, low, high, task.fade);
    const Fade t = fade_over(task.t, task.t_count, u, v, low, high, task.fade);
    const F keep = s.keep * t.keep, size = area < all(0) ? -area : area;
    const F w = counts ? size * keep * exponential((overlap - task.level) / task.width) : F{};
    const F z = load(at.t_z + n), z_u = load(at.t_u + n), z_v = load(at.t_v + n);
    const F r[3] = {u - task.To[0], v - task.To[1], z - task.To[2]};
    // -(r x N) and -N with N = (-z_u, -z_v, 1)
    F g[5] = {-(r[1] + r[2] * z_v), r[2] * z_u + r[0], r[0] * z_v - r[1] * z_u, z_u, z_v};
    const F pull = task.width * t.slope / most(t.keep, all(1e-12f));
    const F q[3] = {t.foot[0] - task.To[0], t.foot[1] - task.To[1], t.foot[2] - task.To[2]};
    g[0] += pull * (q[2] * t.inward_v);
    g[1] -= pull * (q[2] * t.inward_u);
    g[2] -= pull * (q[0] * t.inward_v - q[1] * t.inward_u);
    g[3] -= pull * t.inward_u;
    g[4] -= pull * t.inward_v;
    weight += w;
    edge += keep < all(0.999f) ? w : F{};
    border += area < all(0) ? w : F{};
    const F s_u = load(at.s_u + n), s_v = load(at.s_v + n);
    steep += most(s_u * s_u + s_v * s_v, z_u * z_u + z_v * z_v) > all(kSteepest * kSteepest) ? w : F{};
    const F p[3] = {u, v, z};
    for (int k = 0; k < 3; ++k) point[k] += counts ? w * p[k] : F{};
    for (int k = 0; k < 5; ++k) gradient[k] += counts ? w * g[k] : F{};
  }
  sums.weight += total(weight), sums.edge += total(edge), sums.border += total(border), sums.steep += total(steep);
  for (int k = 0; k < 3; ++k) sums.point[k] += total(point[k]);
  for (int k = 0; k < 5; ++k) sums.gradient[k] += total(gradient[k]);
}

}  // namespace

const Kernels FARFEEL_KERNELS{overlaps_at, add_up, FARFEEL_NAME};

}  // namespace farfeel::penetration::simd
