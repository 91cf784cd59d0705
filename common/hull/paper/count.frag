#version 450 core
// Discards the pixels of the plane that are not object pixels of one camera; if `empty`, keeps
// exactly those in its image that are not object pixels. A projective texture also covers points
// behind its camera; q > 0 keeps the points in front of it. Discards all points outside the hull's
// box.
layout(binding = 0) uniform sampler2D object_pixels;
layout(location = 4) uniform bool empty;
layout(location = 6) uniform vec3 box_min_m;
layout(location = 7) uniform vec3 box_max_m;
in vec3 stq, p_world_m;
void main() {
  if (any(lessThan(p_world_m, box_min_m)) || any(greaterThan(p_world_m, box_max_m))) discard;
  if (!(stq.z > 0.0)) discard;
  vec2 st = stq.xy / stq.z;
  bool object = textureLod(object_pixels, st, 0.0).r >= 0.5,
       in_image = st.x >= 0.0 && st.y >= 0.0 && st.x < 1.0 && st.y < 1.0;
  if (empty ? object || !in_image : !object) discard;
}
