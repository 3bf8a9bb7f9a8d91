// The picture's shaders, GLSL 3.30. Colours are linear; the framebuffer turns them into sRGB.
#pragma once

namespace farfeel::master_station {

inline constexpr const char* kBodyVertexShader = R"glsl(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tint_sRGB;
uniform mat4 clip_from_world;
out vec3 world;
out vec3 world_normal;
out vec3 tint;
invariant gl_Position;  // two passes must agree on depth
void main() {
  world = position;
  world_normal = normal;
  tint = pow(tint_sRGB.rgb, vec3(2.2));
  gl_Position = clip_from_world * vec4(position, 1);
}
)glsl";

inline constexpr const char* kDepthFragmentShader = R"glsl(#version 330 core
void main() {}
)glsl";

/// A key light with a soft shadow, a weak light from behind, and a sky that is brighter than the ground.
inline constexpr const char* kBodyFragmentShader = R"glsl(#version 330 core
in vec3 world;
in vec3 world_normal;
in vec3 tint;
uniform vec3 eye, towards_light, colour;
uniform mat4 light_from_world;
uniform sampler2DShadow shadow;
uniform float opacity;   // below 1 only for what is seen through something else
uniform float gloss;
uniform float lifted;    // how far a point is moved off its own shadow [m]
out vec4 result;

float lit(vec3 n) {
  vec4 at = light_from_world * vec4(world + lifted * n, 1);
  vec3 p = at.xyz / at.w * 0.5 + 0.5;
  if (any(lessThan(p, vec3(0))) || any(greaterThan(p, vec3(1)))) return 1.0;
  vec2 texel = 1.9 / vec2(textureSize(shadow, 0));
  float sum = 0.0;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y) sum += texture(shadow, vec3(p.xy + texel * vec2(x, y), p.z));
  return sum / 9.0;
}

void main() {
  vec3 to_eye = normalize(eye - world);
  vec3 n = normalize(world_normal);
  if (dot(n, to_eye) < 0.0 && !gl_FrontFacing) n = -n;
  float key = max(dot(n, towards_light), 0.0) * lit(n);
  float back = max(dot(n, normalize(vec3(-towards_light.xy, 0.3))), 0.0);
  float sky = 0.5 + 0.5 * n.z;
  vec3 light = 0.78 * key * vec3(1.0, 0.97, 0.92) + 0.14 * back * vec3(0.8, 0.9, 1.0) +
               mix(vec3(0.13, 0.125, 0.12), vec3(0.30, 0.33, 0.37), sky);
  vec3 halfway = normalize(to_eye + towards_light);
  float shine = gloss * key * pow(max(dot(n, halfway), 0.0), 42.0);
  result = vec4(colour * tint * light + vec3(shine), opacity);
}
)glsl";

/// One triangle over everything.
inline constexpr const char* kGroundVertexShader = R"glsl(#version 330 core
uniform mat4 world_from_clip;
out vec3 near_point, far_point;
void main() {
  vec2 p = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0;
  vec4 a = world_from_clip * vec4(p, -1, 1), b = world_from_clip * vec4(p, 1, 1);
  near_point = a.xyz / a.w;
  far_point = b.xyz / b.w;
  gl_Position = vec4(p, 0.999999, 1);
}
)glsl";

/// Background and ground: a plane with a grid that fades into the sky, and the shadow on it.
inline constexpr const char* kGroundFragmentShader = R"glsl(#version 330 core
in vec3 near_point, far_point;
uniform mat4 light_from_world;
uniform sampler2DShadow shadow;
uniform float ground_z, cell, radius;
uniform vec2 shade_low, shade_high;  // where on the shadow map anything casts one
out vec4 result;

float line(vec2 at, float spacing) {
  vec2 g = at / spacing, width = fwidth(g) * 1.1;
  vec2 off = abs(fract(g - 0.5) - 0.5);
  vec2 on = (1.0 - smoothstep(vec2(0), width, off)) * clamp(0.35 / max(width, vec2(1e-6)), 0.0, 1.0);
  return max(on.x, on.y);
}

void main() {
  vec3 along = far_point - near_point;
  vec3 sky = mix(vec3(0.80, 0.835, 0.875), vec3(0.60, 0.66, 0.73), clamp(normalize(along).z + 0.6, 0.0, 1.0));
  float t = (ground_z - near_point.z) / along.z;
  vec3 p = near_point + t * along;
  float away = length(p.xy) / radius;
  float fade = t > 0.0 ? 1.0 - smoothstep(1.0, 4.5, away) : 0.0;
  vec4 at = light_from_world * vec4(p, 1);
  vec3 s = at.xyz / at.w * 0.5 + 0.5;
  // In software a branch costs as much as what it leaves out, a loop that ends does not: hence a loop that has no turn
  // where there can be no shadow.
  bool may_be_shaded = t > 0.0 && s.z < 1.0 && all(greaterThan(s.xy, shade_low)) && all(lessThan(s.xy, shade_high));
  int taps = may_be_shaded ? 49 : 0;
  vec2 texel = 2.2 / vec2(textureSize(shadow, 0));
  float shaded = 0.0;
  for (int i = 0; i < taps; ++i)
    shaded += 1.0 - texture(shadow, vec3(s.xy + texel * vec2(i % 7 - 3, i / 7 - 3), s.z - 0.001));
  float lit = 1.0 - shaded / 49.0;
  float grid = max(0.5 * line(p.xy, cell), line(p.xy, 10.0 * cell));
  vec3 ground = vec3(0.83, 0.855, 0.885) * (1.0 - 0.16 * grid) * mix(0.55, 1.0, lit);
  result = vec4(mix(sky, ground, fade), 1);
}
)glsl";

inline constexpr const char* kSmoothVertexShader = R"glsl(#version 330 core
void main() {
  gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0, 1);
}
)glsl";

/// Edges without steps, found in the finished picture: where brightness changes, colours are averaged along the edge.
/// Timothy Lottes, FXAA, NVIDIA 2009.
inline constexpr const char* kSmoothFragmentShader = R"glsl(#version 330 core
uniform sampler2D picture;
out vec4 result;

float brightness(vec3 colour) { return sqrt(dot(colour, vec3(0.299, 0.587, 0.114))); }
vec3 colour_at(ivec2 at) { return texelFetch(picture, clamp(at, ivec2(0), textureSize(picture, 0) - 1), 0).rgb; }

void main() {
  ivec2 here = ivec2(gl_FragCoord.xy);
  vec2 pixel = 1.0 / vec2(textureSize(picture, 0)), at = gl_FragCoord.xy * pixel;
  vec3 middle = colour_at(here);
  vec3 c_nw = colour_at(here + ivec2(-1, 1)), c_ne = colour_at(here + ivec2(1, 1));
  vec3 c_sw = colour_at(here + ivec2(-1, -1)), c_se = colour_at(here + ivec2(1, -1));
  float m = brightness(middle), nw = brightness(c_nw), ne = brightness(c_ne), sw = brightness(c_sw), se = brightness(c_se);
  float darkest = min(m, min(min(nw, ne), min(sw, se))), brightest = max(m, max(max(nw, ne), max(sw, se)));
  float contrast = brightest - darkest;

  vec2 along = vec2((sw + se) - (nw + ne), (ne + se) - (nw + sw));
  float least = min(abs(along.x), abs(along.y)) + max((nw + ne + sw + se) * 0.03125, 0.0078125);
  along = clamp(along / least, vec2(-8.0), vec2(8.0)) * pixel;
  vec3 near = 0.5 * (texture(picture, at - along / 6.0).rgb + texture(picture, at + along / 6.0).rgb);
  vec3 far = 0.5 * near + 0.25 * (texture(picture, at - 0.5 * along).rgb + texture(picture, at + 0.5 * along).rgb);
  float b = brightness(far);
  vec3 smoothed = b < darkest || b > brightest ? near : far;
  // What is thinner than a pixel stands out on both sides: it is drawn fainter.
  float stands_out = abs(0.25 * (nw + ne + sw + se) - m) / max(contrast, 1e-6);
  smoothed = mix(smoothed, 0.25 * (c_nw + c_ne + c_sw + c_se), 0.75 * smoothstep(0.25, 1.0, stands_out));
  result = vec4(contrast < max(0.0312, 0.125 * brightest) ? middle : smoothed, 1);
}
)glsl";

}  // namespace farfeel::master_station
