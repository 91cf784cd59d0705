#version 450 core
//! include "overlay.glsl"
flat in vec3 rgb;
out vec3 colour;

void main() {
  vec2 across = 2.0 * gl_PointCoord - 1.0;
  if (dot(across, across) > 1.0 || is_skipped()) discard;
  colour = colour_of(rgb);
}
