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
flat out float size_px;  // of the square
flat out float is_round;  // 0: it fills its square of pixels
// A disc with a smaller diameter may miss every pixel centre.
const float kMinRound_px = 1.4142136;
// More than half the field of view. Its tangent is still small enough for a square's size.
const float kMaxFromAxis_rad = 1.5;

void main() {
  vec4 p = eye_from_world * vec4(p_world_m, 1.0);
  center_eye_m = p.xyz;
  gl_Position = clip_from_eye * p;
  // In perspective a ball's image is an ellipse. It reaches farthest away from the view's axis.
  float from_axis_rad = acos(clamp(p.z / length(p.xyz), 0.0, 1.0));
  float cone_rad = asin(min(radius_m / length(p.xyz), 1.0));
  float farthest_rad = min(from_axis_rad + cone_rad, kMaxFromAxis_rad);
  float reach_px = focal_px * max(tan(farthest_rad) - tan(min(from_axis_rad, farthest_rad)), 0.0);
  // A smaller square may miss every pixel centre.
  size_px = max(2.0 * reach_px, 1.0);
  gl_PointSize = size_px;
  is_round = 2.0 * radius_m * focal_px / max(p.z, radius_m) > kMinRound_px ? 1.0 : 0.0;
}
