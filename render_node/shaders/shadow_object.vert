#version 450 core
// Vertices of a virtual object in the light's view.
layout(location = 0) in vec3 p_object_m;
uniform mat4 light_clip_from_object;
out float depth_m;

void main() {
  gl_Position = light_clip_from_object * vec4(p_object_m, 1.0);
  depth_m = gl_Position.w;
}
