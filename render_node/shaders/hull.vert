#version 450 core
// A rectangle over the part of the view that contains the hull. covered_px is in pixels of the
// reconstruction; its pinhole and gl_clip_from_camera() (common/geometry/gl_camera.h) map it.
// The fragment shader sets the depth.
uniform mat4 clip_from_eye;
uniform vec4 covered_px;  // u0 v0 u1 v1, half-open
uniform vec2 focal_px;
uniform vec2 center_px;
out vec2 texel;  // texel (u, v) covers [u, u + 1) x [v, v + 1)

void main() {
  texel = mix(covered_px.xy, covered_px.zw, vec2(gl_VertexID & 1, gl_VertexID >> 1));
  vec4 clip = clip_from_eye * vec4((texel - 0.5 - center_px) / focal_px, 1.0, 1.0);
  gl_Position = vec4(clip.xy / clip.w, 0.0, 1.0);
}
