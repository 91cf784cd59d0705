// Triangles, their parts, and the state of the refinement. The effect of a pass on a part does not
// depend on the order of the other parts, only on the states that the passes before it stored for
// the part's triangle.
layout(std140, binding = 0) uniform Cameras { Camera maps[64]; };
// As RefinedTriangle in gl_contact_buffers.h.
struct Triangle {
  vec3 v0; float per_start;
  vec3 v1; float radius_m;
  vec3 v2; int sampled;
  int rows, finest; uint unused_a, unused_b;
};
layout(std430, binding = 2) readonly buffer Triangles { Triangle triangles[]; };
layout(std430, binding = 3) buffer Refinement {
  Dispatch parts[48];
  Dispatch blocks, samples;
};
// By triangle: (pass in which a point was found, pass in which it was deferred to the CPU).
layout(std430, binding = 7) coherent buffer States { uvec2 states[]; };
layout(location = 2) uniform uint pass;
layout(location = 3) uniform uint room;
const uint kDown = 0x80000000u, kWholePartInHull = 0xffffffffu, kUndecided = 1000u;

// Coordinates in units of the part's level; `unit` is such a unit as a fraction of an edge.
struct PartCoordinates { float a, b, sigma, unit; int level; };
PartCoordinates coordinates_of(uvec4 part, Triangle t) {
  uint level = part.z >> 24;
  float unit = t.per_start * uintBitsToFloat(127u - level << 23);  // 2^-level, exactly
  return PartCoordinates(float(part.y & ~kDown), float(part.z & 0xffffffu),
                         (part.y & kDown) != 0u ? -1.0 : 1.0, unit, int(level));
}
vec3 point(Triangle t, float unit, float a, float b) {
  precise float at_a = a * unit, at_b = b * unit;
  precise vec3 p = t.v0 + at_a * (t.v1 - t.v0) + at_b * (t.v2 - t.v0);
  return p;
}
// Classifies a point in one camera: kFree, kSolid, or kMixed if float cannot decide.
uint classify_point(Camera c, float radius_m, vec3 p) {
  vec3 uvw = project(c, p);
  float error = error_of(c, radius_m),
        margin = uvw.z > 0.0 ? margin_px(c, error, uvw.z) : 1.0;
  if (uvw.z < c.behind * error) return kFree;
  if (!(margin < max_margin_px)) return kMixed;
  vec2 uv = uvw.xy / uvw.z, pixel = floor(uv), off = uv - pixel;
  // Near a border, the exact image may be in the next pixel.
  if (min(off.x, off.y) < margin || max(off.x, off.y) > 1.0 - margin) return kMixed;
  return extent_at(c, clamp_to_stored(c, pixel)) > 0.0 ? kFree : kSolid;
}
