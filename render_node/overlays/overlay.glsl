// Hidden parts cover every second pixel. Unlike with blending, overlapping marks stay faint.
const vec3 kOutlineColour = vec3(0.05);  // sRGB
uniform int is_hidden;
uniform int is_outline;
bool is_skipped() {
  ivec2 p = ivec2(gl_FragCoord.xy);
  return is_hidden != 0 && ((p.x + p.y) & 1) != 0;
}
vec3 colour_of(vec3 rgb) { return is_outline != 0 ? kOutlineColour : rgb; }
