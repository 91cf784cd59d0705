// Declarations that the passes over a view share: its maps, and the box of equal pixels around a
// pixel. The C++ side is gl_hull_shaders.h.
const int kFar = 99;         // distance of a region of cells
const int kMaxCameras = 64;  // as in gl_hull_shaders.h
const float kNoHull = 0.0;   // as in hull.h
layout(std430, binding = 1) readonly buffer Distances { uint distances[]; };
struct ViewMap {
  dvec4 eye, column, row, constant;
  ivec4 bounds, pixels, cells, image;
};

layout(std140, binding = 0) uniform View {
  dvec4 range_m;  // near, far; z: min_seen of Limits::seen
  dvec4 eye_m, column_of_view, row_of_view, constant_of_view, box_min_m, box_max_m;
  ViewMap maps[kMaxCameras];
};

layout(location = 0) uniform int cameras;
// Returns the slope of a ray's image in a map: (U, V, W) at depth t is eye + t * slope.
dvec3 slope_of(int camera, dvec2 ray) {
  return maps[camera].column.xyz * ray.x +
         (maps[camera].row.xyz * ray.y + maps[camera].constant.xyz);
}

// Returns the direction of a ray in the world: the point at depth t is eye_m + t * direction.
dvec3 direction_of(dvec2 ray) {
  return column_of_view.xyz * ray.x + (row_of_view.xyz * ray.y + constant_of_view.xyz);
}

// A box of pixels around `at` that are all of one kind: background if distance > 0, object if
// distance < 0. |distance| == 1: a pixel of the other kind is adjacent.
struct Region {
  int distance;
  ivec2 at;
  int reach, scale;
};

vec2 low_of(Region r) { return vec2(r.scale * (r.at - r.reach + 1)); }
vec2 high_of(Region r) { return vec2(r.scale * (r.at + r.reach)); }
vec2 border_ahead(Region r, bvec2 forward) {
  return vec2(r.scale * (r.at + mix(ivec2(1 - r.reach), ivec2(r.reach), forward)));
}

uint nibble(ivec4 grid, ivec2 at) {
  return distances[grid.x + at.y * grid.y + (at.x >> 3)] >> 4 * (at.x & 7) & 15u;
}

// Returns the region around `pixel`. Beyond the crop it returns the region of the nearest pixel of
// the crop, which is far from all object pixels.
Region region_around(int camera, ivec2 pixel) {
  ivec2 at = clamp(pixel, ivec2(0), maps[camera].pixels.wz - 1), cell = at >> 3;
  int far = int(nibble(maps[camera].cells, cell));
  // Only cells that are set or adjacent to a set cell have distances per pixel.
  if (far > 1 && far < 8) return Region(kFar, cell, far, 8);
  uint code = nibble(maps[camera].pixels, at);
  int reach = int(code & 7u);
  return Region(code < 8u ? reach : -reach, at, reach, 1);
}
