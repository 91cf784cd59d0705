// The shaders of the renderer. They compute linear light in the eye frame (x right, y down, z
// forward, metres) and convert to sRGB themselves, because an sRGB framebuffer of 640x480 pixels
// takes llvmpipe 6 ms longer.
#pragma once

namespace fivepipe::render::shaders {

// A #define, not a uniform, selects the features of a program (flat normals, checker, warmth,
// colour), because llvmpipe computes both sides of a branch. Values that are constant over an
// object reach the fragment shader as flat attributes, because llvmpipe loads a uniform again for
// every pixel.
inline constexpr const char* kVersion = "#version 450 core\n";

// One point light, dimmer with distance, over light from the sky that is stronger from above.
inline constexpr const char* kLight = R"(
// sRGB's curve to within 0.41 of 255 levels: the minimax quotient of these degrees, found by linear programming.
vec3 srgb(vec3 linear) {
  vec3 c = clamp(linear, 0.0, 1.0);
  return c * (15.17117 + c * (186.35132 + c * 62.08699)) / (1.0 + c * (69.73164 + c * 193.09235));
}
// Lengths in units of the distance at which the light has its nominal strength. towards_light: normal . to_light, for a unit normal;
// up: normal . up; square: to_light . to_light.
vec3 lit(vec3 albedo, float towards_light, float up, float square) {
  float diffuse = 1.6 * max(towards_light, 0.0) / (sqrt(square) * (1.0 + square));
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
uniform float light_reach_m;  // where the light has its nominal strength
uniform vec3 albedo;
out vec3 to_light;            // in units of it
flat out vec3 surface_albedo;
#ifdef FLAT
flat out vec2 towards_light_and_up;  // the same all over the triangle
#else
out vec3 normal_eye;
out float normal_up;
#endif
#ifdef CHECKER
uniform float cells_per_m;
out vec2 half_cell;
#endif
#ifdef WARMED
out float warmth;
#endif
void main() {
  vec4 p = eye_from_object * vec4(p_object_m, 1.0);
  to_light = (light_eye_m - p.xyz) / light_reach_m;
  surface_albedo = albedo;
  vec3 n = mat3(eye_from_object) * normal_object;
#ifdef FLAT
  if (dot(n, p.xyz) > 0.0) n = -n;
  towards_light_and_up = vec2(dot(n, to_light), dot(n, up_eye));
#else
  normal_eye = n;
  normal_up = dot(n, up_eye);
#endif
#ifdef CHECKER
  half_cell = 0.5 * cells_per_m * pattern_m;
#endif
#ifdef WARMED
  warmth = vertex_warmth;
#endif
  gl_Position = clip_from_eye * p;
}
)";

// Both sides are lit: a normal is turned to the side that is seen. The checker is averaged over the
// pixel's footprint (Quilez, "Filtering the checkerboard pattern").
inline constexpr const char* kObjectFragment = R"(
in vec3 to_light;
flat in vec3 surface_albedo;
#ifdef FLAT
flat in vec2 towards_light_and_up;
#else
in vec3 normal_eye;
in float normal_up;
#endif
out vec4 colour;
#ifdef CHECKER
in vec2 half_cell;
// Which part of the pixel's footprint odd cells have.
float odd() {
  vec2 footprint = max(fwidth(half_cell), vec2(5e-5));
  vec2 i = abs(fract(half_cell - 0.5 * footprint) - 0.5) - abs(fract(half_cell + 0.5 * footprint) - 0.5);
  return 0.5 - 0.5 * (i.x * i.y) / (footprint.x * footprint.y);
}
#endif
#ifdef WARMED
in float warmth;
uniform vec3 warm_albedo;  // at warmth 1; it glows in this colour, too
#endif
void main() {
  vec3 surface = surface_albedo;
#ifdef CHECKER
  surface *= 1.0 - DARKER_ODD_CELLS * odd();
#endif
#ifdef WARMED
  surface = mix(surface, warm_albedo, warmth);
#endif
#ifndef FLAT
  // Between smooth corners a normal gets shorter.
  vec2 towards_light_and_up = (gl_FrontFacing ? 1.0 : -1.0) * inversesqrt(dot(normal_eye, normal_eye)) * vec2(dot(normal_eye, to_light), normal_up);
#endif
  vec3 light = lit(surface, towards_light_and_up.x, towards_light_and_up.y, max(dot(to_light, to_light), 1e-6));
#ifdef WARMED
  light += 0.4 * warmth * warm_albedo;
#endif
  colour = vec4(srgb(light), 1.0);
}
)";

// The part of the view that holds the hull, as a rectangle of the reconstruction's pixels carried
// into the view by its pinhole and the one conversion to GL's camera; depth comes from the
// fragment.
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

// Whether there is hull is the nearest texel's answer. Within one surface depth and colour are
// interpolated between the four texels around, 1 / z linearly, which is exact for planes; across a
// silhouette never. Where nobody sent colour: grey, lit by the normal that the gradient of 1 / z
// gives (for a plane n . p = d: 1 / z = n . ray / d).
inline constexpr const char* kHullFragment = R"(
in vec2 texel;
uniform sampler2D depth_m;
uniform vec2 focal_px;
uniform float max_tilt_tangent;            // tangent of the tilt up to which neighbouring texels are one surface
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
uniform float light_reach_m;
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
  float jump = min(max_tilt_tangent / focal_px.x, 0.5) * z;
  bool one_surface = all(lessThan(abs(around - z), vec4(jump)));
  float inverse_z = one_surface ? between(1.0 / around, f) : 1.0 / z;
  // Hull at the far plane stays in front of the background, at depth 1.
  gl_FragDepth = clamp(0.5 + 0.5 * (window_depth_terms.x + window_depth_terms.y * inverse_z), 0.0, 0.99999994);
#ifdef COLOURED
  vec2 c = one_surface ? f : to_nearest;
  colour = vec4(mix(mix(colour_at(first), colour_at(first + ivec2(1, 0)), c.x), mix(colour_at(first + ivec2(0, 1)), colour_at(first + ivec2(1, 1)), c.x), c.y), 1.0);
#else
  vec3 normal = normal_at(first + ivec2(to_nearest), z, jump), to_light = (light_eye_m - vec3((from_first - centre_px) / focal_px, 1.0) / inverse_z) / light_reach_m;
  colour = vec4(srgb(lit(grey, dot(normal, to_light), dot(normal, up_eye), max(dot(to_light, to_light), 1e-6))), 1.0);
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

}  // namespace fivepipe::render::shaders
