#version 450 core
// One invocation traces one uncertain ray in double from its own start, by the steps of
// ray_walk.cpp.
//! include "view.glsl"
//! include "work.glsl"
//! include "clip.glsl"
//! include "walk.glsl"

layout(local_size_x = 64) in;
layout(r32f, binding = 0) writeonly uniform image2D depth_m;

// Returns the first depth >= t at which the ray is on the object of map c, or kNever if there is
// none before `end`.
double first_on_object(int c, dvec3 eye, dvec3 slope, double t, double end) {
  ivec4 bounds = maps[c].bounds;
  bool right = slope.x * eye.z > eye.x * slope.z, down = slope.y * eye.z > eye.y * slope.z;
  double w = eye.z + t * slope.z;
  int u = pixel(eye.x, slope.x, w, t, bounds.x, bounds.z - 1),
      v = pixel(eye.y, slope.y, w, t, bounds.y, bounds.w - 1);
  while (u >= bounds.x && v >= bounds.y && u < bounds.z && v < bounds.w) {
    Region free = region_around(c, ivec2(u, v));
    if (free.distance < 0) return t;
    ivec2 low = ivec2(low_of(free)), high = ivec2(high_of(free));
    double at_u = crossing(eye.x, slope.x, eye.z, slope.z, double(right ? high.x : low.x), t);
    double at_v = crossing(eye.y, slope.y, eye.z, slope.z, double(down ? high.y : low.y), t);
    t = min(at_u, at_v);
    if (!(t < end)) return kNever;
    w = eye.z + t * slope.z;
    if (at_u <= at_v) {
      u = right ? high.x : low.x - 1;
      v = pixel(eye.y, slope.y, w, t, low.y, high.y - 1);
    } else {
      v = down ? high.y : low.y - 1;
      u = pixel(eye.x, slope.x, w, t, low.x, high.x - 1);
    }
  }
  return kNever;
}

// Returns the first depth of the ray in the hull, or kNever. Maps are tested in turn until all
// agree on a depth.
double first_in_hull(dvec2 ray) {
  range = range_m.xy;
  clip_to_box(ray);
  for (int c = 0; c < cameras && range.x < range.y; ++c) {
    dvec3 eye = maps[c].eye.xyz, slope = slope_of(c, ray);
    dvec4 bounds = dvec4(maps[c].bounds);
    clip(eye.z - kNearestToCamera_m, slope.z);
    clip(eye.x - bounds.x * eye.z, slope.x - bounds.x * slope.z);
    clip(bounds.z * eye.z - eye.x, bounds.z * slope.z - slope.x);
    clip(eye.y - bounds.y * eye.z, slope.y - bounds.y * slope.z);
    clip(bounds.w * eye.z - eye.y, bounds.w * slope.z - slope.y);
  }
  if (!(range.x < range.y)) return kNever;
  double t = range.x;
  for (int c = 0, agreeing = 0; agreeing < cameras; c = c + 1 == cameras ? 0 : c + 1) {
    double at = first_on_object(c, maps[c].eye.xyz, slope_of(c, ray), t, range.y);
    if (at == kNever) return kNever;
    agreeing = at > t ? 1 : agreeing + 1;
    t = at;
  }
  return t;
}

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < ray_count; i += gl_NumWorkGroups.x * 64u) {
    uvec2 ray = uvec2(uncertain[i] & 0xffffu, uncertain[i] >> 16);
    double t = first_in_hull(dvec2(ray));
    imageStore(depth_m, ivec2(ray), vec4(t < kNever ? float(t) : kNoHull, 0.0, 0.0, 0.0));
  }
}
