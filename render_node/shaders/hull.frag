#version 450 core
//! variant
//! variant -DCOLOURED
//! variant -DLIT -DCOLOURED
//! variant -DSHADOWED
//! variant -DLIT -DCOLOURED -DSHADOWED
// Pixels of the hull. The nearest texel decides whether the pixel shows the hull. Within one
// surface, depth and colour are interpolated between the four nearest texels, 1 / z linearly, which
// is exact for planes. The shader never interpolates across a silhouette.
//
// COLOURED: the frame has colour; otherwise the hull is grey. LIT, or a grey hull: lit by the
// normal that the gradient of 1 / z gives (for a plane n . p = d, 1 / z = n . ray / d). SHADOWED:
// the light casts shadows on what it lights.
//! include "depth.glsl"
#ifndef COLOURED
#define LIT
#endif
#ifdef LIT
//! include "light.glsl"
#ifdef SHADOWED
//! include "shadow.glsl"
uniform mat4 light_from_eye;
#endif
#endif
in vec2 texel;
uniform sampler2D depth_m;
uniform vec2 focal_px;
uniform float max_tilt_tangent;  // two texels are one surface up to this tangent of its tilt
out vec3 colour;

float depth_at(ivec2 t) {
  return texelFetch(depth_m, clamp(t, ivec2(0), textureSize(depth_m, 0) - 1), 0).r;
}
float between(vec4 of, vec2 f) { return mix(mix(of.x, of.y, f.x), mix(of.z, of.w, f.x), f.y); }

#ifdef COLOURED
uniform sampler2D bgr;
vec3 colour_at(ivec2 t) {
  return texelFetch(bgr, clamp(t, ivec2(0), textureSize(bgr, 0) - 1), 0).rgb;
}
#endif
#ifdef LIT
uniform vec2 center_px;
uniform vec3 grey;
uniform vec3 light_eye_m;
uniform vec3 up_eye;
uniform float light_reach_m;

// The hull of binary maps is faceted by their pixels: with colour, the light averages over facets.
#ifdef COLOURED
#define REACH 4
#else
#define REACH 1
#endif
// Returns the change of 1 / z per texel, over up to REACH texels to each side on one surface.
float slope(ivec2 t, ivec2 along, float z, float jump) {
  float before = z, after = z;
  int from = 0, to = 0;
  for (int i = 1; i <= REACH; ++i) {
    float b = depth_at(t - i * along), a = depth_at(t + i * along);
    if (from == i - 1 && abs(b - before) < jump) before = b, from = i;
    if (to == i - 1 && abs(a - after) < jump) after = a, to = i;
  }
  return from + to > 0 ? (1.0 / after - 1.0 / before) / float(from + to) : 0.0;
}
vec3 normal_at(ivec2 t, float z, float jump) {
  vec2 g = vec2(slope(t, ivec2(1, 0), z, jump), slope(t, ivec2(0, 1), z, jump));
  return -normalize(vec3(g * focal_px, 1.0 / z - dot(g, vec2(t) - center_px)));
}
#endif

void main() {
  vec2 from_first = texel - 0.5;
  ivec2 first = ivec2(floor(from_first));
  vec2 f = from_first - vec2(first), to_nearest = step(0.5, f);
  vec4 around = vec4(depth_at(first), depth_at(first + ivec2(1, 0)),
                     depth_at(first + ivec2(0, 1)), depth_at(first + ivec2(1, 1)));
  float z = between(around, to_nearest);
  if (z == 0.0) discard;
  float jump = min(max_tilt_tangent / focal_px.x, 0.5) * z;
  bool one_surface = all(lessThan(abs(around - z), vec4(jump)));
  float inverse_z = one_surface ? between(1.0 / around, f) : 1.0 / z;
  gl_FragDepth = window_depth(window_depth_terms.x + window_depth_terms.y * inverse_z);
#ifdef COLOURED
  vec2 c = one_surface ? f : to_nearest;
  colour = mix(mix(colour_at(first), colour_at(first + ivec2(1, 0)), c.x),
               mix(colour_at(first + ivec2(0, 1)), colour_at(first + ivec2(1, 1)), c.x), c.y);
#endif
#ifdef LIT
#ifdef COLOURED
  vec3 albedo = colour;  // linear: the texture's format is sRGB
#else
  vec3 albedo = grey;
#endif
  vec3 normal = normal_at(first + ivec2(to_nearest), z, jump);
  vec3 p = vec3((from_first - center_px) / focal_px, 1.0) / inverse_z;
  vec3 to_light = (light_eye_m - p) / light_reach_m;
  float towards_light = dot(normal, to_light);
#ifdef SHADOWED
  if (towards_light > 0.0)
    towards_light *= light_reaching((light_from_eye * vec4(p, 1.0)).xyz,
                                    mat3(light_from_eye) * normal);
#endif
  colour = srgb(lit(albedo, towards_light, dot(normal, up_eye), dot(to_light, to_light)));
#endif
}
