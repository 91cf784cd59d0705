#version 450 core
//! variant
//! variant -DSHADOWED
// Pixels of a ball.
//! include "depth.glsl"
//! include "light.glsl"
#ifdef SHADOWED
//! include "shadow.glsl"
uniform mat4 light_from_eye;
#endif
flat in vec3 center_eye_m;
flat in float size_px;
flat in float is_round;
uniform float radius_m;
uniform float focal_px;
uniform vec3 albedo;
uniform vec3 light_eye_m;
uniform vec3 up_eye;
uniform float light_reach_m;  // distance at which the light has its nominal strength
out vec3 colour;
// Of a ball around the eye. Far below any near_m.
const float kMinDepth_m = 1e-6;

void main() {
  vec2 from_center_px = (gl_PointCoord - 0.5) * size_px;
  vec3 ray = normalize(vec3(center_eye_m.xy / center_eye_m.z + from_center_px / focal_px, 1.0));
  // From the ray to the centre. Its square is precise, unlike the difference of two squares.
  vec3 across_m = center_eye_m - dot(ray, center_eye_m) * ray;
  float inside_m2 = radius_m * radius_m - dot(across_m, across_m);
  if (is_round > 0.5 && inside_m2 < 0.0) discard;
  vec3 normal = normalize(-across_m - sqrt(max(inside_m2, 0.0)) * ray);
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
