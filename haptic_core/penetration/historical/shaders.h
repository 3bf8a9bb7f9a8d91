// The source's two passes and its reduction as shaders, GLSL 4.50; the first follows egl::heights_source().
#pragma once

namespace farfeel::penetration::historical {

/// Eleven tiles beside each other; a vertex is (place in the window, 0 to 1; z) and (tile, its chart's record).
inline constexpr const char* kPatchVertexShader = R"glsl(#version 450 core
layout(location = 0) in vec3 place;
layout(location = 1) in uvec2 tile_chart;
uniform float tiles;
out vec3 at;
flat out uint chart;
out gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[4]; };
void main() {
  at = place;
  chart = tile_chart.y;
  gl_ClipDistance[0] = place.x, gl_ClipDistance[1] = 1 - place.x;
  gl_ClipDistance[2] = place.y, gl_ClipDistance[3] = 1 - place.y;
  gl_Position = vec4(2 * (float(tile_chart.x) + place.x) / tiles - 1, 2 * place.y - 1, 0, 1);
}
)glsl";

/// Height of the texture over the coarse point, and with it the depth: z_low at 1 / 65535, one below the other end.
inline constexpr const char* kPatchFragmentShader = R"glsl(
in vec3 at;
flat in uint chart;
uniform vec4 window;  // low, size
uniform vec2 range;   // z_low, 1 / size
void main() {
  float z = at.z;
  if (chart != 0xFFFFFFFFu) {
    Chart c = chart_at(chart);
    vec2 uv = window.xy + at.xy * window.zw;
    vec3 p = c.p_H + c.u_H * uv.x + c.v_H * uv.y + c.z_H * z;
    z += (c.offset + c.scale * spline_at(c, p.xy * c.texels_per_m).value - p.z) / c.z_H.z;
  }
  gl_FragDepth = (1 + 65533 * clamp((z - range.x) * range.y, 0.0, 1.0)) / 65535;
}
)glsl";

inline constexpr const char* kWholeVertexShader = R"glsl(#version 450 core
void main() {
  vec2 p = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0;
  gl_Position = vec4(p, 0, 1);
}
)glsl";

/// Overlap at every pixel of every tile: (overlap, index of the pixel, z of T, 1).
inline constexpr const char* kOverlapFragmentShader = R"glsl(#version 450 core
uniform sampler2D s_depth, t_depth;
uniform vec4 ranges;  // z_low and size of S, of T
uniform float deepest;
uniform int n;
out vec4 overlap;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy), own = ivec2(pixel.x % n, pixel.y);
  float s = texelFetch(s_depth, own, 0).r * 65535, t = texelFetch(t_depth, pixel, 0).r * 65535;
  float s_z = ranges.x + ranges.y * (s - 1) / 65533, t_z = ranges.z + ranges.w * (t - 1) / 65533;
  bool is_there = s > 0.5 && t < 65534.5 && s_z - t_z <= deepest;
  overlap = vec4(is_there ? s_z - t_z : -1e30, float(own.y * n + own.x), t_z, 1);
}
)glsl";

/// Halves each tile's side.
inline constexpr const char* kReduceFragmentShader = R"glsl(#version 450 core
uniform sampler2D larger;
uniform int n_larger, n;
out vec4 most;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  int tile = pixel.x / n;
  ivec2 first = 2 * ivec2(pixel.x % n, pixel.y);
  most = vec4(-1e30, 0, 0, 1);
  for (int k = 0; k < 4; ++k) {
    ivec2 own = first + ivec2(k & 1, k >> 1);
    if (own.x >= n_larger || own.y >= n_larger) continue;
    vec4 candidate = texelFetch(larger, ivec2(tile * n_larger + own.x, own.y), 0);
    if (candidate.x > most.x) most = candidate;
  }
}
)glsl";

}  // namespace farfeel::penetration::historical
