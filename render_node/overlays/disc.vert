#version 450 core
// A disc around a point, drawn as a square of pixels. Its depth is that of a point lift_m nearer.
layout(location = 0) in vec3 p_world_m;
layout(location = 1) in vec3 vertex_rgb;
uniform mat4 eye_from_world;
uniform mat4 clip_from_eye;
uniform float diameter_px;
uniform float near_m;
uniform float lift_m;
flat out vec3 rgb;

void main() {
  vec3 p = (eye_from_world * vec4(p_world_m, 1.0)).xyz;
  rgb = vertex_rgb;
  gl_Position = clip_from_eye * vec4(p, 1.0);
  gl_PointSize = diameter_px;
  if (p.z < near_m) return;  // nearer than the near plane, which clips it
  vec4 lifted = clip_from_eye * vec4(p.xy, max(p.z - lift_m, near_m), 1.0);
  gl_Position.z = max(lifted.z / lifted.w, -1.0) * gl_Position.w;
}
