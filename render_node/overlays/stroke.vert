#version 450 core
// A corner of an arrow's triangles (arrow_strokes.h).
layout(location = 0) in vec3 p_ndc;
layout(location = 1) in vec3 vertex_rgb;
flat out vec3 rgb;

void main() {
  rgb = vertex_rgb;
  gl_Position = vec4(p_ndc, 1.0);
}
