#version 450 core
//! variant
//! variant -DFLAT
//! variant -DCHECKER -DWARMED
//! variant -DFLAT -DCHECKER -DWARMED
//! variant -DSHADOWED
//! variant -DFLAT -DSHADOWED
//! variant -DTEXTURED
//! variant -DCHECKER -DWARMED -DTEXTURED -DSHADOWED
// Vertices of a virtual object.
//
// A #define, not a uniform, selects the features of a program, because llvmpipe computes both sides
// of a branch: FLAT (each triangle has one normal), CHECKER (pattern), WARMED (warmth by vertex),
// SHADOWED (the light casts shadows), TEXTURED (a texture multiplies the albedo).
// Values that are constant over an object reach the fragment shader as flat attributes, because
// llvmpipe loads a uniform again for every pixel.
layout(location = 0) in vec3 p_object_m;
layout(location = 1) in vec3 normal_object;
layout(location = 2) in vec2 pattern_m;
layout(location = 3) in float vertex_warmth;
uniform mat4 eye_from_object;
uniform mat4 clip_from_eye;
uniform vec3 light_eye_m;
uniform vec3 up_eye;
uniform float light_reach_m;  // distance at which the light has its nominal strength
uniform vec3 albedo;
out vec3 to_light;  // in units of light_reach_m
flat out vec3 surface_albedo;
#ifdef FLAT
flat out vec2 towards_light_and_up;  // constant over the triangle
#else
out vec3 normal_eye;
out float normal_up;
#endif
#ifdef SHADOWED
uniform mat4 light_from_eye;
out vec3 p_light;
#endif
#ifdef CHECKER
uniform float cells_per_m;
out vec2 half_cell;
#endif
#ifdef WARMED
out float warmth;
#endif
#ifdef TEXTURED
layout(location = 4) in vec2 uv;  // (0, 0) is the top left corner of the image
uniform vec3 added_albedo;        // the part that the texture does not multiply
flat out vec3 surface_added;
out vec2 texture_uv;
#endif

void main() {
  vec4 p = eye_from_object * vec4(p_object_m, 1.0);
  to_light = (light_eye_m - p.xyz) / light_reach_m;
  surface_albedo = albedo;
  vec3 n = mat3(eye_from_object) * normal_object;
#ifdef SHADOWED
  p_light = (light_from_eye * p).xyz;
#endif
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
#ifdef TEXTURED
  surface_added = added_albedo;
  texture_uv = uv;
#endif
  gl_Position = clip_from_eye * p;
}
