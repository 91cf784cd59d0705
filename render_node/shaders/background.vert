#version 450 core
// One triangle that covers the view at depth 1.
out float height;  // 0 at the bottom of the image, 1 at its top

void main() {
  vec2 corner = vec2((gl_VertexID & 1) == 0 ? -1.0 : 3.0, (gl_VertexID & 2) == 0 ? -1.0 : 3.0);
  height = 0.5 + 0.5 * corner.y;
  gl_Position = vec4(corner, 1.0, 1.0);
}
