#version 450 core
//! variant
//! variant -DSHADOWED
// Pixels of a ball, by parallel projection: the ball is small.
//! include "depth.glsl"
//! include "light.glsl"
#ifdef SHADOWED
//! include "shadow.glsl"
uniform mat4 light_from_eye;
#endif
flat in vec3 center_eye_m;
flat in float is_round;
uniform float radius_m;
uniform vec3 albedo;
uniform vec3 light_eye_m;
uniform vec3 up_eye;
uniform float light_reach_m;  // distance at which the light has its nominal strength
out vec3 colour;
// Of a ball around the eye. Far below any near_m.
const float kMinDepth_m = 1e-6;

void main() {
  vec2 across = 2.0 * gl_PointCoord - 1.0;
  if (is_round > 0.5 && dot(across, across) > 1.0) discard;
  vec3 normal = vec3(across, -sqrt(max(1.0 - dot(across, across), 0.0)));
  vec3 p = center_eye_m + radius_m * normal;
  gl_FragDepth = window_depth(window_depth_terms.x + window_depth_terms.y / max(p.z, kMinDepth_m));
  vec3 to_light = (light_eye_m - p) / light_reach_m;
  float towards_light = dot(normal, to_light);
#ifdef SHADOWED
  // A particle casts no shadow, so its centre is compared with the map.
  if (towards_light > 0.0)
    towards_light *= light_reaching((light_from_eye * vec4(center_eye_m, 1.0)).xyz,
                                    mat3(light_from_eye) * to_light);
#endif
  colour = srgb(lit(albedo, towards_light, dot(normal, up_eye), dot(to_light, to_light)));
}
