#version 450 core
//! variant
//! variant -DSHADOWED
// A particle, drawn as a square of pixels around the ball's image.
layout(location = 0) in vec3 p_world_m;
uniform mat4 eye_from_world;
uniform mat4 clip_from_eye;
uniform float radius_m;
uniform float focal_px;
flat out vec3 center_eye_m;
flat out float is_round;  // 0: it fills its square of pixels
// A disc with a smaller diameter may miss every pixel centre.
const float kMinRound_px = 1.4142136;

void main() {
  vec4 p = eye_from_world * vec4(p_world_m, 1.0);
  center_eye_m = p.xyz;
  gl_Position = clip_from_eye * p;
  // A smaller square may miss every pixel centre.
  float radius_px = radius_m * focal_px / max(p.z, radius_m);
  gl_PointSize = max(2.0 * radius_px, 1.0);
  is_round = 2.0 * radius_px > kMinRound_px ? 1.0 : 0.0;
}
