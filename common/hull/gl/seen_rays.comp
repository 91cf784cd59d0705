#version 450 core
//! variant -DCAMERAS=4
//! variant -DCAMERAS=16
//! variant -DCAMERAS=64
// Limits::seen. One workgroup handles the rays of one tile, one invocation per ray, in double from
// the tile's start, by the steps of ray_walk.cpp: a camera that sees the ray in its image on no
// object pixel moves it on to where the image leaves the box of such pixels. If too few cameras see
// it, it moves on to where the next one may.
//! include "view.glsl"
//! include "work.glsl"
//! include "clip.glsl"
//! include "walk.glsl"

const int kCameras = CAMERAS;  // maximum; `cameras` is the actual number
layout(local_size_x = 8, local_size_y = 8) in;
layout(r32f, binding = 0) writeonly uniform image2D depth_m;
const int kUnseen = 0, kEmpty = 1, kObject = 2;
// Covers the rounding of a tile's length.
const double kLengthSlack = 1.0lf + 1e-6lf;

// A camera's verdict on the ray up to depth `end`, and the box of equal pixels that the ray's image
// leaves there.
struct Walk {
  double end, last;  // last: the ray leaves the image
  int verdict;
  bool in_box, along_u, right, down;
  ivec2 low, high;
};

Walk begin_walk(int c, dvec2 ray) {
  dvec3 eye = maps[c].eye.xyz, slope = slope_of(c, ray);
  dvec4 image = dvec4(maps[c].image);
  range = range_m.xy;
  clip(eye.z - kNearestToCamera_m, slope.z);
  if (range.x < range.y) clip(eye.x - image.x * eye.z, slope.x - image.x * slope.z);
  if (range.x < range.y) clip(image.z * eye.z - eye.x, image.z * slope.z - slope.x);
  if (range.x < range.y) clip(eye.y - image.y * eye.z, slope.y - image.y * slope.z);
  if (range.x < range.y) clip(image.w * eye.z - eye.y, image.w * slope.z - slope.y);
  Walk w;
  w.end = range.x < range.y ? range.x : kNever;
  w.last = range.y;
  w.verdict = kUnseen;
  w.in_box = w.along_u = false;
  w.right = slope.x * eye.z > eye.x * slope.z;
  w.down = slope.y * eye.z > eye.y * slope.z;
  w.low = w.high = ivec2(0);
  return w;
}

// Sets the verdict of a pixel of the image, which holds until the ray leaves the box of equal
// pixels around it. There is no object beyond the crop.
void enter(int c, dvec3 eye, dvec3 slope, ivec2 at, double t, inout Walk w) {
  Region region = region_around(c, at);
  ivec4 image = maps[c].image;
  w.low = max(mix(ivec2(low_of(region)), image.xy, lessThan(at, ivec2(0))), image.xy);
  w.high = min(mix(ivec2(high_of(region)), image.zw, greaterThanEqual(at, maps[c].pixels.wz)),
               image.zw);
  double at_u = crossing(eye.x, slope.x, eye.z, slope.z, double(w.right ? w.high.x : w.low.x), t),
         at_v = crossing(eye.y, slope.y, eye.z, slope.z, double(w.down ? w.high.y : w.low.y), t);
  w.in_box = true;
  w.along_u = at_u <= at_v;
  w.end = min(at_u, at_v);
  w.verdict = region.distance < 0 ? kObject : kEmpty;
}

// Sets the verdict just after depth t. An image at the end of its box crosses the border by index,
// because its rounded position may be on either side.
void walk_to(int c, dvec2 ray, double t, inout Walk w) {
  ivec4 image = maps[c].image;
  dvec3 eye = maps[c].eye.xyz, slope = slope_of(c, ray);
  double depth = eye.z + t * slope.z;
  bool crosses = w.in_box && t == w.end;
  ivec2 low = crosses ? w.low : image.xy, high = crosses ? w.high : image.zw,
        at = ivec2(pixel(eye.x, slope.x, depth, t, low.x, high.x - 1),
                   pixel(eye.y, slope.y, depth, t, low.y, high.y - 1));
  if (crosses && w.along_u) at.x = w.right ? w.high.x : w.low.x - 1;
  if (crosses && !w.along_u) at.y = w.down ? w.high.y : w.low.y - 1;
  if (!(t < w.last) || any(lessThan(at, image.xy)) || any(greaterThanEqual(at, image.zw))) {
    w.verdict = kUnseen;
    w.end = kNever;
    w.last = t;
  } else {
    enter(c, eye, slope, at, t, w);
  }
}

// Returns the first depth in [t, end) just after which the ray is in the hull, or kNever.
double first_in_hull(dvec2 ray, double t, double end) {
  Walk walks[kCameras];
  for (int c = 0; c < cameras; ++c) walks[c] = begin_walk(c, ray);
  while (t < end) {
    int seen = 0;
    bool empty = false;
    double next = kNever;
    for (int c = 0; c < cameras && !empty; ++c) {
      if (!(t < walks[c].end)) walk_to(c, ray, t, walks[c]);
      empty = walks[c].verdict == kEmpty;
      if (walks[c].verdict == kObject) ++seen;
      else next = empty ? walks[c].end : min(next, walks[c].end);
    }
    if (!empty && seen >= int(range_m.z)) return t;
    t = next;
  }
  return kNever;
}

void main() {
  uint slot = gl_WorkGroupID.y * kGroupsPerRow + gl_WorkGroupID.x;
  if (slot >= tile_count) return;
  Tile tile = tiles[slot];
  uvec2 in_tile = gl_LocalInvocationID.xy;
  if (in_tile.x < (tile.rays & 15u) || in_tile.x > (tile.rays >> 4 & 15u) ||
      in_tile.y < (tile.rays >> 8 & 15u) || in_tile.y > tile.rays >> 12)
    return;
  uvec2 ray = uvec2(tile.corner & 0xffffu, tile.corner >> 16) + in_tile;
  range = dvec2(tile.begin_m,
                min(range_m.y, tile.begin_m + double(tile.length_m) * kLengthSlack));
  clip_to_box(dvec2(ray));
  if (!(range.x < range.y)) return;
  double t = first_in_hull(dvec2(ray), range.x, range.y);
  if (t < kNever) imageStore(depth_m, ivec2(ray), vec4(float(t), 0.0, 0.0, 0.0));
}
