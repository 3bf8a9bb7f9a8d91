// Height of one chart's felt surface over many points, and what it can do around them. Included by simd_kernels.inl.

namespace farfeel::penetration::simd {
namespace {

constexpr float kLeastSlope = 0.05f;
/// A step of Newton along the ray that moves less than this across the chart is the last: what it leaves behind, after
/// the second-order correction, is the texture's change of curvature times its square, some nanometres.
constexpr float kSmallMove = 6e-6f;
constexpr int kMostSteps = 12;
constexpr float kMet = 3e-6f;  // [m] past the relief, for a ray that still meets the surface

struct Height {
  F z, z_u, z_v, z_uu, z_uv, z_vv;
  I is_met;  // false where the ray passes the texture by
};

/// One spline sample: coefficients and their derivatives by (s, t), in coefficients and texels.
struct Spline {
  F value, s, t, ss, st, tt;
};

template <typename Facet>
inline Spline spline_at(const Facet& f, F s_texels, F t_texels) {
  const F s = least(most(s_texels, all(0)), all(static_cast<float>(f.columns)));
  const F t = least(most(t_texels, all(0)), all(static_cast<float>(f.rows)));
  I i = __builtin_convertvector(s, I), j = __builtin_convertvector(t, I);
  i = i < f.columns - 1 ? i : I{} + (f.columns - 1);
  j = j < f.rows - 1 ? j : I{} + (f.rows - 1);
  const F x = s - __builtin_convertvector(i, F) - 0.5f, y = t - __builtin_convertvector(j, F) - 0.5f;
  const F xa = 0.5f - x, xb = 0.5f + x, ya = 0.5f - y, yb = 0.5f + y, x2 = 2 * x;
  const F wx[3] = {0.5f * xa * xa, 0.75f - x * x, 0.5f * xb * xb};
  const F wy[3] = {0.5f * ya * ya, 0.75f - y * y, 0.5f * yb * yb};
  const F sy[3] = {-ya, -2 * y, yb}, cy[3] = {all(1), all(-2), all(1)};
  Spline at{};
  I index = j * f.stride + i;
  for (int row = 0; row < 3; ++row, index += f.stride) {
    const FourTexels c = gather_four(f.heights, index);  // two a word, the lower one first
    const F c0 = __builtin_convertvector(c.first & 0xFFFF, F), c2 = __builtin_convertvector(c.second & 0xFFFF, F);
    const F c1 = __builtin_convertvector((c.first >> 16) & 0xFFFF, F);
    const F value = c0 * wx[0] + c1 * wx[1] + c2 * wx[2], slope = c2 * xb - c1 * x2 - c0 * xa, bend = c0 - 2 * c1 + c2;
    at.value += wy[row] * value;
    at.s += wy[row] * slope;
    at.ss += wy[row] * bend;
    at.t += sy[row] * value;
    at.st += sy[row] * slope;
    at.tt += cy[row] * value;
  }
  return at;
}

/// The felt surface over (u, v), by Newton along the ray from z; see facing_patch.cpp. coarse_z: the facet's plane
/// there.
[[gnu::always_inline]] inline Height height_over(const LaneChart& f, F u, F v, F z, F coarse_z, I mine) {
  if (!f.heights) return {coarse_z, all(f.plane[1]), all(f.plane[2]), F{}, F{}, F{}, I{} - 1};
  const F lowest = coarse_z + f.reach_down, highest = coarse_z + f.reach_up;
  const float a = f.axes[2][0], b = f.axes[2][1], per_texel = f.texels_per_m;
  z = least(most(z, lowest), highest);
  F base[3];
  for (int k = 0; k < 3; ++k) base[k] = f.to_H[k][0] + f.to_H[k][1] * u + f.to_H[k][2] * v;
  F h_s{}, h_t{}, h_ss{}, h_st{}, h_tt{}, G_z{}, dz{};
  I met{};
  for (int step = 0; step < kMostSteps; ++step) {
    const Spline c = spline_at(f, base[0] + f.to_H[0][3] * z, base[1] + f.to_H[1][3] * z);
    h_s = c.s * (f.scale * per_texel);
    h_t = c.t * (f.scale * per_texel);
    const float bend = f.scale * per_texel * per_texel;
    h_ss = c.ss * bend, h_st = c.st * bend, h_tt = c.tt * bend;
    G_z = f.axes[2][2] - h_s * a - h_t * b;
    G_z = f.toward * G_z > kLeastSlope ? G_z : all(f.toward * kLeastSlope);
    const F next = z - (base[2] + f.to_H[2][3] * z - (f.offset + f.scale * c.value)) * reciprocal(G_z);
    const F held = least(most(next, lowest), highest);
    dz = held - z;
    met = (size_of(held - next) < kMet) & (size_of(dz) * f.tilt < kSmallMove);
    z = held;
    if (f.tilt < 1e-4f || bits_of(mine & (size_of(dz) * f.tilt >= kSmallMove)) == 0) break;
  }
  met &= size_of(z - coarse_z) * f.tilt <= f.most_drift;
  // The last step's sample stands a little aside: to second order.
  const F ds = a * dz, dt = b * dz;
  z += 0.5f * (h_ss * ds * ds + 2 * h_st * ds * dt + h_tt * dt * dt) * reciprocal(G_z);
  h_s += h_ss * ds + h_st * dt;
  h_t += h_st * ds + h_tt * dt;
  G_z = f.axes[2][2] - h_s * a - h_t * b;
  G_z = f.toward * G_z > kLeastSlope ? G_z : all(f.toward * kLeastSlope);
  const F per_G = reciprocal(G_z);
  const F z_u = (h_s * f.axes[0][0] + h_t * f.axes[0][1] - f.axes[0][2]) * per_G;
  const F z_v = (h_s * f.axes[1][0] + h_t * f.axes[1][1] - f.axes[1][2]) * per_G;
  // Where the sample goes in the chart as u and v grow.
  const F us = f.axes[0][0] + a * z_u, ut = f.axes[0][1] + b * z_u, vs = f.axes[1][0] + a * z_v,
          vt = f.axes[1][1] + b * z_v;
  return {z,
          z_u,
          z_v,
          (h_ss * us * us + 2 * h_st * us * ut + h_tt * ut * ut) * per_G,
          (h_ss * us * vs + h_st * (us * vt + ut * vs) + h_tt * ut * vt) * per_G,
          (h_ss * vs * vs + 2 * h_st * vs * vt + h_tt * vt * vt) * per_G,
          met};
}

/// What a chart's texture may do around (u, v, z), as far as its level of bounds speaks: a plane above it (along the
/// chart's outward direction), as a height at (u, v), and how much its surface may bend upwards.
struct Limit {
  F top, bend;
};

inline Limit limit_over(const LaneChart& f, F u, F v, F z, F coarse_z) {
  if (!f.heights) return {coarse_z, F{}};
  if (!f.bounds) return {all(f.toward * -kNowhere), all(f.most_bend)};
  F at[2];
  for (int k = 0; k < 2; ++k) {
    at[k] = f.to_H[k][0] + f.to_H[k][1] * u + f.to_H[k][2] * v + f.to_H[k][3] * z;
    at[k] = least(most(at[k] * f.bounds_per_texel, all(0)), all(1e6f));
  }
  I i = __builtin_convertvector(at[0], I), j = __builtin_convertvector(at[1], I);
  i = i < f.bounds_columns - 1 ? i : I{} + (f.bounds_columns - 1);
  j = j < f.bounds_rows - 1 ? j : I{} + (f.bounds_rows - 1);
  const I entry = gather(f.bounds, j * f.bounds_columns + i);
  const F h = f.offset + f.scale * __builtin_convertvector(entry & 0xFFFF, F);
  return {f.plane[0] + f.plane[1] * u + f.plane[2] * v + f.lift * h,
          f.bend_scale * __builtin_convertvector((entry >> 16) & 0xFFFF, F)};
}

}  // namespace
}  // namespace farfeel::penetration::simd
