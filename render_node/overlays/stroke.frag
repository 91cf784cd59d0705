#version 450 core
//! include "overlay.glsl"
flat in vec3 rgb;
out vec3 colour;

void main() {
  if (is_skipped()) discard;
  colour = colour_of(rgb);
}
