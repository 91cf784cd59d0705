#version 450 core
// Discards the pixels of the plane that are not object pixels of one camera; if `empty`, keeps
// exactly those in its image that are not object pixels. A projective texture also covers points
// behind its camera; q > 0 keeps the points in front of it.
layout(binding = 0) uniform sampler2D object_pixels;
layout(location = 4) uniform bool empty;
in vec3 stq;
void main() {
  if (!(stq.z > 0.0)) discard;
  vec2 st = stq.xy / stq.z;
  bool object = textureLod(object_pixels, st, 0.0).r >= 0.5,
       in_image = st.x >= 0.0 && st.y >= 0.0 && st.x < 1.0 && st.y < 1.0;
  if (empty ? object || !in_image : !object) discard;
}
