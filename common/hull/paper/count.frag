#version 450 core
// Discards the pixels of the plane that are not object pixels of one camera. A projective texture
// also covers points behind its camera; q > 0 keeps the points in front of it.
layout(binding = 0) uniform sampler2D object_pixels;
in vec3 stq;
void main() {
  if (!(stq.z > 0.0)) discard;
  if (textureLod(object_pixels, stq.xy / stq.z, 0.0).r < 0.5) discard;
}
