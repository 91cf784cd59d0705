#version 450 core
// Places a triangle in its viewport and passes on its projection into one camera.
layout(location = 0) in vec2 position;
layout(location = 1) in vec3 stq;
out vec3 interpolated_stq;
void main() {
  interpolated_stq = stq;
  gl_Position = vec4(position, 0.0, 1.0);
}
