// The renderer's shaders. All light is computed in linear light, in the eye's frame (x right, y down, z forward, metres), and written
// as sRGB by the shader: llvmpipe takes 6 ms longer over 640x480 pixels of an sRGB framebuffer.
#pragma once

namespace fivepipe::shaders {

// What the objects or hulls of a frame don't have (curvature, a pattern, warmth, colour) is left out of their program by a #define, not by a
// uniform: llvmpipe computes both sides of a branch.
inline constexpr const char* kVersion = "#version 450 core\n";

// One point light, dimmer with distance, over light from the sky that is stronger from above.
inline constexpr const char* kLight = R"(
uniform float light_reach_m;  // where the light has its nominal strength
// sRGB's curve to within 0.4 of 255 levels, by square roots (Taylor, "sRGB approximations for HLSL").
vec3 srgb(vec3 linear) {
  vec3 c = clamp(linear, 0.0, 1.0), c2 = sqrt(c), c4 = sqrt(c2), c8 = sqrt(c4);
  return 0.662002687 * c2 + 0.684122060 * c4 - 0.323583601 * c8 - 0.0225411470 * c;
}
// towards_light: normal . to_light_m, for a unit normal; up: normal . up. One root and one quotient.
vec3 lit(vec3 albedo, float towards_light_m, float up, float square_m2) {
  float reach_m2 = light_reach_m * light_reach_m;
  float diffuse = max(towards_light_m, 0.0) * (1.6 * reach_m2) / (sqrt(square_m2) * (reach_m2 + square_m2));
  return albedo * (vec3(0.135, 0.1425, 0.155) + up * vec3(0.065, 0.0775, 0.095) + diffuse * vec3(1.0, 0.97, 0.92));
}
)";

inline constexpr const char* kObjectVertex = R"(
layout(location = 0) in vec3 p_object_m;
layout(location = 1) in vec3 normal_object;
layout(location = 2) in vec2 pattern_m;
layout(location = 3) in float vertex_warmth;
uniform mat4 eye_from_object;
uniform mat4 clip_from_eye;
uniform vec3 light_eye_m;
uniform vec3 up_eye;
out vec3 to_light_m;
#ifdef FLAT
flat out vec2 towards_light_m_and_up;  // the same all over the triangle
#else
out vec3 normal_eye;
out float normal_up;
#endif
#ifdef CHECKER
uniform float cells_per_m;
out vec2 cell;
#endif
#ifdef WARMED
out float warmth;
#endif
void main() {
  vec4 p = eye_from_object * vec4(p_object_m, 1.0);
  to_light_m = light_eye_m - p.xyz;
  vec3 n = mat3(eye_from_object) * normal_object;
#ifdef FLAT
  if (dot(n, p.xyz) > 0.0) n = -n;
  towards_light_m_and_up = vec2(dot(n, to_light_m), dot(n, up_eye));
#else
  normal_eye = n;
  normal_up = dot(n, up_eye);
#endif
#ifdef CHECKER
  cell = pattern_m * cells_per_m;
#endif
#ifdef WARMED
  warmth = vertex_warmth;
#endif
  gl_Position = clip_from_eye * p;
}
)";

// Both sides are lit: a normal is turned to the side that is seen. The checker is averaged over the pixel's footprint
// (Quilez, "Filtering the checkerboard pattern").
inline constexpr const char* kObjectFragment = R"(
in vec3 to_light_m;
#ifdef FLAT
flat in vec2 towards_light_m_and_up;
#else
in vec3 normal_eye;
in float normal_up;
#endif
uniform vec3 albedo;
out vec4 colour;
#ifdef CHECKER
in vec2 cell;
uniform vec3 albedo_of_odd_cells;
float odd() {
  vec2 footprint = max(fwidth(cell), vec2(1e-4));
  vec2 i = 2.0 * (abs(fract((cell - 0.5 * footprint) * 0.5) - 0.5) - abs(fract((cell + 0.5 * footprint) * 0.5) - 0.5)) / footprint;
  return 0.5 - 0.5 * i.x * i.y;
}
#endif
#ifdef WARMED
in float warmth;
uniform vec3 warm_albedo;  // at warmth 1; it glows in this colour, too
#endif
void main() {
  vec3 surface = albedo;
#ifdef CHECKER
  surface = mix(albedo, albedo_of_odd_cells, odd());
#endif
#ifdef WARMED
  surface = mix(surface, warm_albedo, warmth);
#endif
#ifndef FLAT
  // Between smooth corners a normal gets shorter.
  vec2 towards_light_m_and_up = (gl_FrontFacing ? 1.0 : -1.0) * inversesqrt(dot(normal_eye, normal_eye)) * vec2(dot(normal_eye, to_light_m), normal_up);
#endif
  vec3 light = lit(surface, towards_light_m_and_up.x, towards_light_m_and_up.y, max(dot(to_light_m, to_light_m), 1e-6));
#ifdef WARMED
  light += 0.4 * warmth * warm_albedo;
#endif
  colour = vec4(srgb(light), 1.0);
}
)";

// The part of the view that holds the hull, as a rectangle of the reconstruction's pixels carried into the view by
// its pinhole and the one conversion to GL's camera; depth comes from the fragment.
inline constexpr const char* kHullVertex = R"(
uniform mat4 clip_from_eye;
uniform vec4 covered_px;  // u0 v0 u1 v1, half-open
uniform vec2 focal_px;
uniform vec2 centre_px;
out vec2 texel;           // texel (u, v) covers [u, u + 1) x [v, v + 1)
void main() {
  texel = vec2((gl_VertexID & 1) == 0 ? covered_px.x : covered_px.z, (gl_VertexID & 2) == 0 ? covered_px.y : covered_px.w);
  vec4 clip = clip_from_eye * vec4((texel - 0.5 - centre_px) / focal_px, 1.0, 1.0);
  gl_Position = vec4(clip.xy / clip.w, 0.0, 1.0);
}
)";

// Whether there is hull is the nearest texel's answer. Within one surface depth and colour are interpolated between the four texels
// around, 1 / z linearly, which is exact for planes; across a silhouette never.
// Where nobody sent colour: grey, lit by the normal that the gradient of 1 / z gives (for a plane n . p = d: 1 / z = n . ray / d).
inline constexpr const char* kHullFragment = R"(
in vec2 texel;
uniform sampler2D depth_m;
uniform vec2 focal_px;
uniform float steepest;            // tangent of the tilt up to which neighbouring texels are one surface
uniform vec2 window_depth_terms;   // NDC depth = x + y / z
out vec4 colour;
float depth_at(ivec2 t) { return texelFetch(depth_m, clamp(t, ivec2(0), textureSize(depth_m, 0) - 1), 0).r; }
float between(vec4 of, vec2 f) { return mix(mix(of.x, of.y, f.x), mix(of.z, of.w, f.x), f.y); }
#ifdef COLOURED
uniform sampler2D bgr;
vec3 colour_at(ivec2 t) { return texelFetch(bgr, clamp(t, ivec2(0), textureSize(bgr, 0) - 1), 0).rgb; }
#else
uniform vec2 centre_px;
uniform vec3 grey;
uniform vec3 light_eye_m;
uniform vec3 up_eye;
float slope(float before, float here, float after, float jump) {
  bool b = abs(before - here) < jump, a = abs(after - here) < jump;
  return a && b ? 0.5 * (1.0 / after - 1.0 / before) : a ? 1.0 / after - 1.0 / here : b ? 1.0 / here - 1.0 / before : 0.0;
}
vec3 normal_at(ivec2 t, float z, float jump) {
  vec2 g = vec2(slope(depth_at(t - ivec2(1, 0)), z, depth_at(t + ivec2(1, 0)), jump),
                slope(depth_at(t - ivec2(0, 1)), z, depth_at(t + ivec2(0, 1)), jump));
  return -normalize(vec3(g * focal_px, 1.0 / z - dot(g, vec2(t) - centre_px)));
}
#endif
void main() {
  vec2 from_first = texel - 0.5;
  ivec2 first = ivec2(floor(from_first));
  vec2 f = from_first - vec2(first), to_nearest = step(0.5, f);
  vec4 around = vec4(depth_at(first), depth_at(first + ivec2(1, 0)), depth_at(first + ivec2(0, 1)), depth_at(first + ivec2(1, 1)));
  float z = between(around, to_nearest);
  if (z == 0.0) discard;
  float jump = min(steepest / focal_px.x, 0.5) * z;
  bool one_surface = all(lessThan(abs(around - z), vec4(jump)));
  float inverse_z = one_surface ? between(1.0 / around, f) : 1.0 / z;
  // Hull at the far plane stays in front of the background, at depth 1.
  gl_FragDepth = clamp(0.5 + 0.5 * (window_depth_terms.x + window_depth_terms.y * inverse_z), 0.0, 0.99999994);
#ifdef COLOURED
  vec2 c = one_surface ? f : to_nearest;
  colour = vec4(mix(mix(colour_at(first), colour_at(first + ivec2(1, 0)), c.x), mix(colour_at(first + ivec2(0, 1)), colour_at(first + ivec2(1, 1)), c.x), c.y), 1.0);
#else
  vec3 normal = normal_at(first + ivec2(to_nearest), z, jump), to_light_m = light_eye_m - vec3((from_first - centre_px) / focal_px, 1.0) / inverse_z;
  colour = vec4(srgb(lit(grey, dot(normal, to_light_m), dot(normal, up_eye), max(dot(to_light_m, to_light_m), 1e-6))), 1.0);
#endif
}
)";

inline constexpr const char* kBackgroundVertex = R"(
out float height;  // 0 at the image's bottom, 1 at its top
void main() {
  vec2 corner = vec2((gl_VertexID & 1) == 0 ? -1.0 : 3.0, (gl_VertexID & 2) == 0 ? -1.0 : 3.0);
  height = 0.5 + 0.5 * corner.y;
  gl_Position = vec4(corner, 1.0, 1.0);
}
)";
inline constexpr const char* kBackgroundFragment = R"(
in float height;
uniform vec3 bottom;
uniform vec3 top;
out vec4 colour;
void main() { colour = vec4(mix(bottom, top, height), 1.0); }
)";

}  // namespace fivepipe::shaders
