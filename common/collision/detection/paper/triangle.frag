#version 450 core
// Discards fragments that are not on an object pixel, or, if on_object is 0, keeps exactly those in
// the image that are not on one. The comparisons are written so that NaN and points behind the
// camera are discarded.
uniform usampler2D object_pixels;  // pixel u of a row is bit u % 32 of texel u / 32
uniform vec2 size_px;
uniform int on_object;
in vec3 interpolated_stq;
void main() {
  if (!(interpolated_stq.z > 0.0)) discard;
  vec2 pixel = floor(interpolated_stq.xy / interpolated_stq.z * size_px);
  if (!(pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < size_px.x && pixel.y < size_px.y)) discard;
  int u = int(pixel.x);
  uint texel = texelFetch(object_pixels, ivec2(u >> 5, int(pixel.y)), 0).r;
  if (int(texel >> uint(u & 31) & 1u) != on_object) discard;
}
