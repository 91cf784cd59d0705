#version 450 core
// Draws a plane of the sweep as one quad over the whole frustum. (s q, t q, q) is linear over it,
// so interpolation is exact to rounding.
layout(location = 0) uniform float plane_depth_m;
layout(location = 1) uniform mat4 clip_from_view;
layout(location = 2) uniform mat4x3 texture_from_view;
layout(location = 3) uniform vec4
    sight_corners;  // x y of two opposite corners of the image at depth 1
layout(location = 5) uniform mat4x3 world_from_view;
out vec3 stq, p_world_m;
void main() {
  vec2 sight = mix(sight_corners.xy, sight_corners.zw, vec2(gl_VertexID & 1, gl_VertexID >> 1));
  vec4 p_view = vec4(sight * plane_depth_m, plane_depth_m, 1.0);
  gl_Position = clip_from_view * p_view;
  stq = texture_from_view * p_view;
  p_world_m = world_from_view * p_view;
}
