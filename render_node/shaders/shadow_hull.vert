#version 450 core
// A rectangle over the light's view.
out vec2 at;  // in the image: 0 to 1, row 0 at the top

void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  at = vec2(corner.x, 1.0 - corner.y);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
