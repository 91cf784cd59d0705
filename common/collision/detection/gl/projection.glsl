// Projection of convex shapes into a camera's map, and the lookup of image rectangles there, as in
// contact_simd.h.
//
// The error bounds rely on `precise`: GLSL then rounds sums and products correctly, in either
// direction. It guarantees quotients to 2.5 units in the last place.
layout(local_size_x = 64) in;
// As GlCamera in gl_contact_buffers.h.
struct Camera {
  vec4 of_x, of_y, of_z, at, stored, bounds;
  int first_byte, stride;
  float farthest_px, behind;
};
layout(std430, binding = 0) readonly buffer SkipMaps { uint skip_maps[]; };
layout(location = 0) uniform int cameras;
layout(location = 1) uniform float max_margin_px;
struct Dispatch { uint groups_x, groups_y, groups_z, items; };
// Classes of a shape; its class for several cameras is the minimum of theirs.
const uint kFree = 0u, kUncertain = 1u, kMixed = 2u, kSolid = 3u;
const uint kMaxGroups = 32768u;

vec3 project(Camera c, vec3 p) {  // (U, V, W)
  precise vec3 uvw = c.at.xyz + p.x * c.of_x.xyz + p.y * c.of_y.xyz + p.z * c.of_z.xyz;
  return uvw;
}
// Bound of the error of U - u W at most radius_m from the frame's origin.
float error_of(Camera c, float radius_m) { return c.of_x.w + radius_m * c.at.w; }
// Bound of the error of images if W is at least min_w [px].
float margin_px(Camera c, float error, float min_w) {
  return error / min_w + c.farthest_px * c.of_z.w;
}
// The skip map at a stored pixel.
float extent_at(Camera c, vec2 pixel) {
  int i = c.first_byte + int(pixel.y) * c.stride + int(pixel.x);
  return float(bitfieldExtract(int(skip_maps[i >> 2]), 8 * (i & 3), 8));
}
vec2 clamp_to_stored(Camera c, vec2 pixel) { return clamp(pixel, c.stored.xz, c.stored.yw); }
// Looks up one square that covers the rectangle, or two along its longer side.
uint classify_rect(Camera c, vec2 low, vec2 high, float margin) {
  low -= margin;
  high += margin;
  if (high.x < c.bounds.x || low.x > c.bounds.y || high.y < c.bounds.z || low.y > c.bounds.w)
    return kFree;
  vec2 first = clamp_to_stored(c, floor(low)), size = floor(high) - first + 1.0;
  float longer = max(size.x, size.y), side = max(min(size.x, size.y), ceil(0.5 * longer)),
        extent = extent_at(c, first);
  if (!(abs(extent) >= side)) return kMixed;
  if (side < longer) {
    vec2 step = mix(vec2(0.0), size - side, greaterThan(size, size.yx));
    float next = extent_at(c, clamp_to_stored(c, first + step));
    if (!(abs(next) >= side) || next < 0.0 != extent < 0.0) return kMixed;
  }
  return extent < 0.0 ? kSolid : kFree;
}
// Classifies a convex shape with these corners, at most radius_m from the origin, in one camera.
uint classify_shape(Camera c, float radius_m, vec3 p0, vec3 p1, vec3 p2) {
  vec3 q0 = project(c, p0), q1 = project(c, p1), q2 = project(c, p2);
  float error = error_of(c, radius_m), min_w = min(q0.z, min(q1.z, q2.z));
  if (max(q0.z, max(q1.z, q2.z)) < c.behind * error) return kFree;
  float margin = min_w > 0.0 ? margin_px(c, error, min_w) : 1.0;
  if (!(margin < max_margin_px)) return kUncertain;
  vec2 uv0 = q0.xy / q0.z, uv1 = q1.xy / q1.z, uv2 = q2.xy / q2.z;
  return classify_rect(c, min(uv0, min(uv1, uv2)), max(uv0, max(uv1, uv2)), margin);
}
