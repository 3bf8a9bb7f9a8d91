R"glsl(
// The felt height of one chart over a point of C's plane, and what its texture can do around it. As in simd_heights.inl:
// coefficients are fetched and blended here, never filtered by the hardware.

layout(std430, binding = HEIGHTS_BINDING) readonly buffer Heights { uint height_pairs[]; };
layout(std430, binding = BOUNDS_BINDING) readonly buffer Bounds { uint bound_entries[]; };
layout(std430, binding = FRAME_BINDING) readonly buffer Frame { uvec4 frame[]; };

const float LEAST_SLOPE = 0.05;
const float SMALL_MOVE = 6e-6;  // [m] across the chart: the last step of Newton
const int MOST_STEPS = 12;
const float MET = 3e-6;  // [m] past the relief, for a ray that still meets the surface
const float ASKEW = 0.35;  // tilt beyond which a ray may meet a chart more than once
const float FAR = 1e30;

vec4 floats_at(uint i) { return uintBitsToFloat(frame[i]); }

struct Chart {
  vec3 u_H, v_H, z_H, p_H;  // C's axes and origin, written in H
  float texels_per_m, offset, scale, most_bend, tilt, toward;
  float up, down, drift;  // reach of the relief along z; how far a ray may drift over the chart
  int first, columns, rows;
  uint at;  // of its record
};

Chart chart_at(uint at) {
  vec4 a = floats_at(at), b = floats_at(at + 1), c = floats_at(at + 2), d = floats_at(at + 3);
  vec4 e = floats_at(at + 4), f = floats_at(at + 5);
  Chart chart;
  chart.u_H = a.xyz, chart.v_H = b.xyz, chart.z_H = c.xyz, chart.p_H = d.xyz;
  chart.texels_per_m = a.w;
  chart.first = int(frame[at + 1].w), chart.columns = int(frame[at + 2].w), chart.rows = int(frame[at + 3].w);
  chart.offset = e.x, chart.scale = e.y, chart.most_bend = e.z, chart.tilt = e.w;
  chart.up = f.x, chart.down = f.y, chart.drift = f.z, chart.toward = f.w;
  chart.at = at;
  return chart;
}

// Three coefficients from one of them on; two a word, the lower one first.
vec3 three_from(int index) {
  uint first = height_pairs[index >> 1], second = height_pairs[(index >> 1) + 1];
  return (index & 1) == 0 ? vec3(first & 0xFFFFu, first >> 16, second & 0xFFFFu)
                          : vec3(first >> 16, second & 0xFFFFu, second >> 16);
}

struct Spline {
  float value, s, t, ss, st, tt;  // in coefficients and texels
};

Spline spline_at(Chart chart, vec2 at) {
  vec2 p = clamp(at, vec2(0), vec2(chart.columns, chart.rows));
  ivec2 ij = min(ivec2(p), ivec2(chart.columns - 1, chart.rows - 1));
  vec2 x = p - vec2(ij) - 0.5, a = 0.5 - x, b = 0.5 + x;
  vec3 wx = vec3(0.5 * a.x * a.x, 0.75 - x.x * x.x, 0.5 * b.x * b.x);
  vec3 wy = vec3(0.5 * a.y * a.y, 0.75 - x.y * x.y, 0.5 * b.y * b.y);
  vec3 dx = vec3(-a.x, -2 * x.x, b.x), dy = vec3(-a.y, -2 * x.y, b.y);
  const vec3 dd = vec3(1, -2, 1);
  int stride = chart.columns + 2, index = chart.first + ij.y * stride + ij.x;
  vec3 c0 = three_from(index), c1 = three_from(index + stride), c2 = three_from(index + 2 * stride);
  vec3 value = vec3(dot(c0, wx), dot(c1, wx), dot(c2, wx));
  vec3 slope = vec3(dot(c0, dx), dot(c1, dx), dot(c2, dx));
  vec3 bend = vec3(dot(c0, dd), dot(c1, dd), dot(c2, dd));
  return Spline(dot(wy, value), dot(wy, slope), dot(dy, value), dot(wy, bend), dot(dy, slope), dot(dd, value));
}

struct Height {
  float z;
  vec2 slope;  // z_u, z_v
  vec3 bend;   // z_uu, z_uv, z_vv
  bool is_met;  // false where the ray passes the texture by
};

// A chart that leans much may meet a ray more than once: there every ray starts at the coarse facet, so that what it
// finds depends on the pose alone.
float start_over(Chart chart, float coarse_z) {
  return chart.tilt > ASKEW ? coarse_z : coarse_z + 0.5 * (chart.up + chart.down);
}

float held_off_zero(float G_z, float toward) { return toward * G_z > LEAST_SLOPE ? G_z : toward * LEAST_SLOPE; }

// By Newton along the ray; see facing_patch.cpp.
Height height_over(Chart chart, vec2 uv, float coarse_z) {
  float lowest = coarse_z + chart.down, highest = coarse_z + chart.up, per_texel = chart.texels_per_m;
  vec3 base = chart.p_H + chart.u_H * uv.x + chart.v_H * uv.y;
  float z = clamp(start_over(chart, coarse_z), lowest, highest), dz = 0, G_z = 1;
  vec2 h_1 = vec2(0);
  vec3 h_2 = vec3(0);
  bool is_met = false;
  for (int step = 0; step < MOST_STEPS; ++step) {
    vec3 p = base + chart.z_H * z;
    Spline c = spline_at(chart, p.xy * per_texel);
    h_1 = vec2(c.s, c.t) * (chart.scale * per_texel);
    h_2 = vec3(c.ss, c.st, c.tt) * (chart.scale * per_texel * per_texel);
    G_z = held_off_zero(chart.z_H.z - dot(h_1, chart.z_H.xy), chart.toward);
    float next = z - (p.z - (chart.offset + chart.scale * c.value)) / G_z;
    float held = clamp(next, lowest, highest);
    dz = held - z;
    is_met = abs(held - next) < MET && abs(dz) * chart.tilt < SMALL_MOVE;
    z = held;
    if (chart.tilt < 1e-4 || abs(dz) * chart.tilt < SMALL_MOVE) break;
  }
  is_met = is_met && abs(z - coarse_z) * chart.tilt <= chart.drift;
  // The last step's sample stands a little aside: to second order.
  vec2 d = chart.z_H.xy * dz;
  z += 0.5 * (h_2.x * d.x * d.x + 2 * h_2.y * d.x * d.y + h_2.z * d.y * d.y) / G_z;
  h_1 += vec2(h_2.x * d.x + h_2.y * d.y, h_2.y * d.x + h_2.z * d.y);
  G_z = held_off_zero(chart.z_H.z - dot(h_1, chart.z_H.xy), chart.toward);
  Height h;
  h.z = z;
  h.slope = vec2(dot(h_1, chart.u_H.xy) - chart.u_H.z, dot(h_1, chart.v_H.xy) - chart.v_H.z) / G_z;
  // Where the sample goes in the chart as u and v grow.
  vec2 U = chart.u_H.xy + chart.z_H.xy * h.slope.x, V = chart.v_H.xy + chart.z_H.xy * h.slope.y;
  h.bend = vec3(h_2.x * U.x * U.x + 2 * h_2.y * U.x * U.y + h_2.z * U.y * U.y,
                h_2.x * U.x * V.x + h_2.y * (U.x * V.y + V.x * U.y) + h_2.z * U.y * V.y,
                h_2.x * V.x * V.x + 2 * h_2.y * V.x * V.y + h_2.z * V.y * V.y) /
           G_z;
  h.is_met = is_met;
  return h;
}

// A plane above what the texture does within `reach` of the point, as its height there and its slope (for S upwards,
// for T, whose chart runs against z, downwards), and how much the surface may bend upwards.
struct Limit {
  float top;
  vec2 slope;
  float bend;
};

Limit limit_over(Chart chart, vec2 uv, float coarse_z, float reach, float small) {
  Limit limit;
  limit.slope = -vec2(chart.u_H.z, chart.v_H.z) / chart.z_H.z;
  limit.top = chart.toward * FAR;
  limit.bend = chart.most_bend;
  if (0.5 * reach * reach * chart.most_bend < small) return limit;
  // Where the ray meets the chart is as uncertain as the height along it, times the lean.
  float known = chart.tilt > ASKEW ? max(abs(chart.up), abs(chart.down)) : 0.5 * (chart.up - chart.down);
  float texels = chart.texels_per_m * (reach + chart.tilt * known);
  int level = int(ceil(log2(max(texels, 1.0)) - 1e-3));
  if (level >= BOUNDS_LEVELS) {  // wider than any level speaks for: the relief alone
    limit.top = coarse_z + (chart.toward > 0 ? chart.up : chart.down) + 3.5 * reach * chart.toward;  // at 60 degrees each
    return limit;
  }
  vec3 p = chart.p_H + chart.u_H * uv.x + chart.v_H * uv.y + chart.z_H * start_over(chart, coarse_z);
  ivec2 size = (ivec2(chart.columns, chart.rows) + (1 << level) - 1) >> level;
  ivec2 ij = clamp(ivec2(clamp(p.xy * chart.texels_per_m, vec2(0), vec2(1e6))) >> level, ivec2(0), size - 1);
  uvec4 levels = frame[chart.at + 6 + uint(level >> 2)];
  uint entry = bound_entries[levels[level & 3] + uint(ij.y * size.x + ij.x)];
  float h = chart.offset + chart.scale * float(entry & 0xFFFFu);
  limit.top = (h - chart.p_H.z) / chart.z_H.z + dot(limit.slope, uv);
  limit.bend = BEND_UNIT * chart.scale * chart.texels_per_m * chart.texels_per_m * float(entry >> 16);
  return limit;
}
)glsl"
