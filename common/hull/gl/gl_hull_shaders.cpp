#include "common/hull/gl/gl_hull_shaders.h"

namespace fivepipe::hull::gl_hull {
namespace {

const char* const kVersion = "#version 450 core\n";

// Up to this many cameras, the pass over rays has its own code for each and keeps the ray's images
// in registers: on llvmpipe 15 % faster for 4, no faster for 16 and seconds to compile.
constexpr int kUnrolledCameras = 4;

// What the passes over a view share: its maps, and how far a map is free around a pixel.
const char* const kView = R"(
layout(std430, binding = 1) readonly buffer Distances { uint distances[]; };
struct ViewMap { dvec4 eye, column, row, constant; ivec4 bounds, pixels, cells; };
layout(std140, binding = 0) uniform View {
  dvec4 range_m;  // near, far
  ViewMap maps[kMaxCameras];
};
layout(location = 0) uniform int cameras;
// A ray's image in a map: (U, V, W) at depth t is eye + t * slope.
dvec3 slope_of(int camera, dvec2 ray) { return maps[camera].column.xyz * ray.x + (maps[camera].row.xyz * ray.y + maps[camera].constant.xyz); }

// A box of pixels around one: all without object (distance > 0) or all object (< 0); +-1: next to the other kind.
struct Region { int distance; ivec2 at; int reach, scale; };
vec2 low_of(Region r) { return vec2(r.scale * (r.at - r.reach + 1)); }
vec2 high_of(Region r) { return vec2(r.scale * (r.at + r.reach)); }
vec2 border_ahead(Region r, bvec2 forward) { return vec2(r.scale * (r.at + mix(ivec2(1 - r.reach), ivec2(r.reach), forward))); }

uint nibble(ivec4 grid, ivec2 at) { return distances[grid.x + at.y * grid.y + (at.x >> 3)] >> 4 * (at.x & 7) & 15u; }
// Beyond the crop: of the nearest pixel on its rim, which is far from all object pixels.
Region region_around(int camera, ivec2 asked) {
  ivec2 at = clamp(asked, ivec2(0), maps[camera].pixels.wz - 1), cell = at >> 3;
  int far = int(nibble(maps[camera].cells, cell));
  if (far > 1 && far < 8) return Region(kFar, cell, far, 8);  // only cells with object in or next to them have distances by pixel
  uint code = nibble(maps[camera].pixels, at);
  int reach = int(code & 7u);
  return Region(code < 8u ? reach : -reach, at, reach, 1);
}
)";

const char* const kWork = R"(
struct Tile { double begin_m; float length_m; uint at_near, corner, rays, unused_a, unused_b; };
layout(std430, binding = 2) buffer Tiles { Tile tiles[]; };
layout(std430, binding = 3) buffer Work { uint tile_groups[3], tile_count, ray_groups[3], ray_count, doubtful[]; };
const uint kGroupsPerRow = 64u, kMaxRayGroups = 32768u;
// Left to the pass in double.
void set_aside(uint u, uint v) {
  uint i = atomicAdd(ray_count, 1u);
  doubtful[i] = u | v << 16;
  if (i % 64u == 0u) atomicMax(ray_groups[0], min(i / 64u + 1u, kMaxRayGroups));
}
)";

// One invocation per tile: clips its rays to where every map can see its object, moves them on
// together while the corner rays' images lie in one empty box (then so do all between), and hands
// on what is left.
const char* const kTiles = R"(
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Candidates { uvec2 candidates[]; };
layout(location = 1) uniform uint candidate_count;
// Slack of the ranges shared by a tile, as a fraction: no ray's own range is cut by rounding.
const double kSlack = 1e-9lf;
const double kNearestToCamera_m = 1e-9lf;  // as map_from_view.h
// Boxes are kept this far from, so that rays don't start next to a pixel border [px].
const double kBorderMargin_px = 1.0lf / 32.0lf;
const double kSpan = 7.0lf;  // from a tile's first ray to its last [px]
const int kMaxSteps = 48;
const float kBeyond_px = 1e30;
dvec2 range;
void clip(double offset, double slope) {
  bool at_begin = offset + range.x * slope >= 0.0lf, at_end = offset + range.y * slope >= 0.0lf;
  if (at_begin && at_end) return;
  double t = -offset / slope;
  if (at_end) range.x = max(range.x, t);
  else if (at_begin) range.y = min(range.y, t);
  else range.y = range.x;
}
// The rays where slope is largest stay longest.
void clip_tile(double at_eye, double column, double row, double constant, double extra) {
  clip(at_eye + extra, constant + max(kSpan * column, 0.0lf) + max(kSpan * row, 0.0lf));
}
void clip_to_map(int c, dvec2 corner) {
  dvec3 eye = maps[c].eye.xyz, column = maps[c].column.xyz, row = maps[c].row.xyz, first = slope_of(c, corner);
  dvec4 bounds = dvec4(maps[c].bounds);
  clip_tile(eye.z, column.z, row.z, first.z, -kNearestToCamera_m);
  clip_tile(eye.x - bounds.x * eye.z, column.x - bounds.x * column.z, row.x - bounds.x * row.z, first.x - bounds.x * first.z, 0.0lf);
  clip_tile(bounds.z * eye.z - eye.x, bounds.z * column.z - column.x, bounds.z * row.z - row.x, bounds.z * first.z - first.x, 0.0lf);
  clip_tile(eye.y - bounds.y * eye.z, column.y - bounds.y * column.z, row.y - bounds.y * row.z, first.y - bounds.y * first.z, 0.0lf);
  clip_tile(bounds.w * eye.z - eye.y, bounds.w * column.z - column.y, bounds.w * row.z - row.y, bounds.w * first.z - first.y, 0.0lf);
}
// Depth >= t up to which one map's object is on none of the tile's rays; t itself where that can't be said.
double free_depth(int c, dvec2 corner, double t) {
  dvec3 eye = maps[c].eye.xyz, column = kSpan * maps[c].column.xyz, row = kSpan * maps[c].row.xyz, first = slope_of(c, corner);
  dvec2 uv[4], middle = dvec2(0.0lf);
  for (int k = 0; k < 4; ++k) {
    dvec3 at = eye + t * (first + double(k & 1) * column + double(k >> 1) * row);
    if (!(at.z > 0.0lf)) return t;
    uv[k] = at.xy / at.z;
    middle += 0.25lf * uv[k];
  }
  ivec2 size = maps[c].pixels.wz, asked = ivec2(floor(clamp(middle, dvec2(-1.0lf), dvec2(size))));
  Region free = region_around(c, asked);
  if (free.distance < 2) return t;
  // There is no object beyond the crop.
  dvec2 low = dvec2(mix(low_of(free), vec2(-kBeyond_px), lessThan(asked, ivec2(0)))) + kBorderMargin_px;
  dvec2 high = dvec2(mix(high_of(free), vec2(kBeyond_px), greaterThanEqual(asked, size))) - kBorderMargin_px;
  double until = range_m.y;
  for (int k = 0; k < 4; ++k) {
    if (!(uv[k].x > low.x && uv[k].y > low.y && uv[k].x < high.x && uv[k].y < high.y)) return t;
    dvec3 slope = first + double(k & 1) * column + double(k >> 1) * row;
    double w = eye.z + t * slope.z;
    dvec2 speed = slope.xy - uv[k] * slope.z;  // times W
    dvec2 border = dvec2(speed.x > 0.0lf ? high.x : low.x, speed.y > 0.0lf ? high.y : low.y);
    dvec2 after = (border - uv[k]) * w / (slope.xy - border * slope.z);
    if (after.x > 0.0lf) until = min(until, t + after.x);
    if (after.y > 0.0lf) until = min(until, t + after.y);
    if (slope.z < 0.0lf) until = min(until, -eye.z / slope.z * (1.0lf - kSlack));
  }
  return max(until, t);
}
void move_on(dvec2 corner) {
  for (int i = 0, c = 0, stuck = 0; i < kMaxSteps && stuck < cameras && range.x < range.y; ++i) {
    double until = free_depth(c, corner, range.x);
    stuck = until > range.x ? 0 : stuck + 1;
    range.x = until;
    if (stuck > 0) c = c + 1 == cameras ? 0 : c + 1;
  }
}
void main() {
  if (gl_GlobalInvocationID.x >= candidate_count) return;
  uvec2 candidate = candidates[gl_GlobalInvocationID.x];
  dvec2 corner = dvec2(candidate.x & 0xffffu, candidate.x >> 16);
  range = range_m.xy;
  for (int c = 0; c < cameras; ++c) {
    clip_to_map(c, corner);
    if (!(range.x < range.y)) return;
  }
  bool at_near = range.x == range_m.x;
  range = dvec2(max(range_m.x, range.x * (1.0lf - kSlack)), min(range_m.y, range.y * (1.0lf + kSlack)));
  double begin = range.x;
  move_on(corner);
  if (!(range.x < range.y)) return;
  uint i = atomicAdd(tile_count, 1u);
  if (i % kGroupsPerRow == 0u) atomicAdd(tile_groups[1], 1u);
  tiles[i] = Tile(range.x, float(range.y - range.x), at_near && range.x == begin ? 1u : 0u, candidate.x, candidate.y, 0u, 0u);
})";

// One invocation per ray of the tiles that are left, in float from the tile's start, each map's
// pixels counted from the one in which the ray starts, so that numbers are small; forms of the
// ray's images are computed in double and rounded once.
//
// Bound of float's rounding. What float knows of a map pixel is within e (error_px) at every depth
// of the range: of U, V and W the offset is rounded once, the slope once, product and sum once
// each, so 3 units (half an ulp) of |offset| + length |slope|; the quotient U / W has 2.5 ulp for
// GLSL's division and half of one for the product, 6 units, 8 with all second-order terms. A depth
// is a crossing of a border by one map's image, at speed v [px/m]: it is within delta = 3 e / v, e
// for offset and slope, at most 5/3 e for the division. Another map then sees its pixel within e +
// delta v'. Four times that is kept from every border that may part object from no object (distance
// +-1); nearer rays are set aside. Factor four, because then each crossing lies more than 3 delta
// beyond the last, and what was certain of other maps from an earlier depth on stays so.
const char* const kRays = R"(
layout(local_size_x = 8, local_size_y = 8) in;
layout(r32f, binding = 0) writeonly uniform image2D depth_m;
const float kCrossingErrors = 3.0, kTolerance = 4.0;
const float kUnit = 5.9604645e-8, kFormUnits = 3.0, kQuotientUnits = 8.0;  // half an ulp of 1
const float kWidestTolerance_px = 0.5;       // a ray's pixel is at most one beside the true one: boxes of distance 2 hold both
const float kMaxFormError_px = 1.0 / 64.0;  // forms worse than this settle too little
const float kNever = 1e30;
const float kFarthest_px = 1e6;  // where counting starts, at most; beyond any map
const float kLengthSlack = 1.0 + 1e-6;  // of float's rounding; the last word is a comparison in double
const int kMaxRepeats = 8;  // on one camera, so that none crawls along its image while another could end the matter
const int kMaxRounds = 64;  // rays that take longer, which none was seen to, are settled in double
const int kActive = 0, kHit = 1, kMiss = 2, kUncertain = 3;

// One map's image of the ray: (U, V, W) at the tile's start, and per metre, for pixels counted from `first`.
struct Form { vec3 start, slope; ivec2 first; float error_px; };
Form form_of(int c, dvec2 ray, double begin_m, float length_m) {
  dvec3 slope = slope_of(c, ray), start = maps[c].eye.xyz + begin_m * slope;
  vec2 first = floor(clamp(vec2(start.xy) / float(start.z), -kFarthest_px, kFarthest_px));
  Form f;
  f.first = ivec2(first);
  f.start = vec3(start - dvec3(dvec2(first), 0.0lf) * start.z);
  f.slope = vec3(slope - dvec3(dvec2(first), 0.0lf) * slope.z);
  vec3 size = abs(f.start) + length_m * abs(f.slope), last = f.start + length_m * f.slope;
  float min_w = min(f.start.z, last.z), reach_px = 2.0 + max(abs(last.x), abs(last.y)) / last.z;
  f.error_px = kUnit * (kFormUnits * (max(size.x, size.y) + reach_px * size.z) / min_w + kQuotientUnits * reach_px);
  if (!(min_w > 0.0 && f.error_px < kMaxFormError_px)) f.error_px = kFarthest_px;
  return f;
}

// Depth from the tile's start, how uncertain it is, and what set it: the border that an image crossed into pixel `entered`.
struct Candidate { float s, delta; int camera, axis, entered, border; };

// Asks one camera; kActive: `now` has moved on, or not (then the camera holds until `holds`).
int ask(int c, Form f, float length_m, inout Candidate now, inout float holds) {
  vec3 at = f.start + now.s * f.slope;
  float inverse = 1.0 / at.z;
  vec2 uv = clamp(at.xy * inverse, -kFarthest_px, kFarthest_px), whole = floor(uv);
  vec2 speed = (f.slope.xy - uv * f.slope.z) * inverse;
  vec2 off = abs(uv - whole - 0.5) + kTolerance * (f.error_px + now.delta * abs(speed));  // > 0.5: next to a border
  bvec2 known = bvec2(now.camera == c && now.axis == 0, now.camera == c && now.axis == 1), forward = greaterThan(speed, vec2(0.0));
  ivec2 pixel = mix(ivec2(whole) + f.first, ivec2(now.entered), known);
  off = mix(off, vec2(0.0), known);
  Region region = region_around(c, pixel);
  if (!(max(off.x, off.y) < (abs(region.distance) == 1 ? 0.5 : 0.5 + kWidestTolerance_px))) return kUncertain;

  // When the image leaves the region; where that only bounds what is known, a little before.
  vec2 border = border_ahead(region, forward) - vec2(f.first);
  if (region.distance < 0) border += mix(vec2(kTolerance), vec2(-kTolerance), forward) * f.error_px;
  vec2 leaves = (border * f.start.z - f.start.xy) / (f.slope.xy - border * f.slope.z);
  leaves = mix(vec2(kNever), leaves, greaterThan(leaves, vec2(now.s)));
  bool along_u = leaves.x <= leaves.y;
  float s = along_u ? leaves.x : leaves.y, crossed = along_u ? border.x : border.y;
  if (region.distance < 0) {
    uv = mix(uv, vec2(now.border - f.first), known);
    holds = all(equal(greaterThan(border, uv), forward)) ? s : now.s;
    return kActive;
  }
  if (!(s < 2.0 * length_m)) return kMiss;
  float delta = kCrossingErrors * f.error_px * (f.start.z + s * f.slope.z) / abs((along_u ? f.slope.x : f.slope.y) - crossed * f.slope.z);
  if (!(s - delta < length_m)) return kMiss;
  if (!(delta < length_m)) return kUncertain;
  int at_border = int(crossed) + (along_u ? f.first.x : f.first.y);
  now = Candidate(s, delta, c, along_u ? 0 : 1, (along_u ? forward.x : forward.y) ? at_border : at_border - 1, at_border);
  return kActive;
}
// Stays with one camera while it moves the candidate on; then it holds until `holds`.
void visit(int c, Form form, float length_m, inout Candidate now, inout float holds, inout bool agreed, inout int state) {
  if (state != kActive || holds > now.s + now.delta) return;
  for (int repeat = 0; repeat < kMaxRepeats; ++repeat) {
    float before = now.s;
    holds = -1.0;
    state = ask(c, form, length_m, now, holds);
    if (state != kActive || now.s == before) break;
    agreed = false;
  }
}
int first_in_hull(double begin_m, float length_m, dvec2 ray, out Candidate now) {
  float holds[kCameras];
  PREPARE
  now = Candidate(0.0, 0.0, -1, 0, 0, 0);
  int state = kActive;
  for (int round = 0; round < kMaxRounds; ++round) {
    bool agreed = true;
    VISIT
    if (state != kActive) return state;
    bool held = true;  // nobody needs to be asked again
    HELD
    if (agreed || held) return kHit;
  }
  return kUncertain;
}
// The crossing again, in double.
double depth_of(Candidate hit, dvec2 ray) {
  dvec3 eye = maps[hit.camera].eye.xyz, slope = slope_of(hit.camera, ray);
  double border = double(hit.border);
  return (border * eye.z - (hit.axis == 0 ? eye.x : eye.y)) / ((hit.axis == 0 ? slope.x : slope.y) - border * slope.z);
}
void main() {
  uint slot = gl_WorkGroupID.y * kGroupsPerRow + gl_WorkGroupID.x;
  if (slot >= tile_count) return;
  Tile tile = tiles[slot];
  uvec2 in_tile = gl_LocalInvocationID.xy;
  if (in_tile.x < (tile.rays & 15u) || in_tile.x > (tile.rays >> 4 & 15u) || in_tile.y < (tile.rays >> 8 & 15u) || in_tile.y > tile.rays >> 12) return;
  uvec2 ray = uvec2(tile.corner & 0xffffu, tile.corner >> 16) + in_tile;
  Candidate hit;
  int state = first_in_hull(tile.begin_m, tile.length_m * kLengthSlack, dvec2(ray), hit);
  if (state == kHit && hit.camera < 0 && tile.at_near == 0u) state = kUncertain;
  if (state == kUncertain) {
    set_aside(ray.x, ray.y);
    return;
  }
  float depth = kNoHull;
  if (state == kHit) {
    double t = hit.camera < 0 ? range_m.x : depth_of(hit, dvec2(ray));
    if (t < range_m.y) depth = float(t);
  }
  imageStore(depth_m, ivec2(ray), vec4(depth, 0.0, 0.0, 0.0));
})";

// One invocation per doubtful ray, in double from its own start: the steps of ray_walk.cpp.
const char* const kResolveExact = R"(
layout(local_size_x = 64) in;
layout(r32f, binding = 0) writeonly uniform image2D depth_m;
const double kNearestToCamera_m = 1e-9lf;  // as map_from_view.h
const double kNever = 1e30lf;

dvec2 range;
void clip(double offset, double slope) {
  bool at_begin = offset + range.x * slope >= 0.0lf, at_end = offset + range.y * slope >= 0.0lf;
  if (at_begin && at_end) return;
  double t = -offset / slope;
  if (at_end) range.x = max(range.x, t);
  else if (at_begin) range.y = min(range.y, t);
  else range.y = range.x;
}
int pixel(double offset, double slope, double w, double t, int least, int most) {
  double at = (offset + t * slope) / w;
  return !(at > double(least)) ? least : at >= double(most) ? most : int(at);
}
double crossing(double offset, double slope, double w_offset, double w_slope, double border, double t) {
  double at = (border * w_offset - offset) / (slope - border * w_slope);
  if (at > t) return at;
  return w_offset + at * w_slope > 0 ? t : kNever;  // rounding has it there already; or only behind the camera
}
double first_on_object(int c, dvec3 eye, dvec3 slope, double t, double end) {
  ivec4 bounds = maps[c].bounds;
  bool right = slope.x * eye.z > eye.x * slope.z, down = slope.y * eye.z > eye.y * slope.z;
  double w = eye.z + t * slope.z;
  int u = pixel(eye.x, slope.x, w, t, bounds.x, bounds.z - 1), v = pixel(eye.y, slope.y, w, t, bounds.y, bounds.w - 1);
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
double first_in_hull(dvec2 ray) {
  range = range_m.xy;
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
    uvec2 ray = uvec2(doubtful[i] & 0xffffu, doubtful[i] >> 16);
    double t = first_in_hull(dvec2(ray));
    imageStore(depth_m, ivec2(ray), vec4(t < kNever ? float(t) : kNoHull, 0.0, 0.0, 0.0));
  }
})";

std::string of_view(const std::string& passes) {
  return kVersion + std::string("const int kFar = 99, kMaxCameras = ") +
         std::to_string(kMaxCameras) + ";\nconst float kNoHull = 0.0;\n" + kView + kWork + passes;
}

}  // namespace

std::string tiles_source() { return of_view(kTiles); }
std::string rays_source(int max_cameras) {
  std::string prepare, visit, held;
  if (max_cameras <= kUnrolledCameras) {
    prepare = "Form forms[kCameras];";
    for (int i = 0; i < max_cameras; ++i) {
      const std::string c = std::to_string(i);
      prepare += " holds[" + c + "] = -1.0; if (" + c + " < cameras) forms[" + c + "] = form_of(" +
                 c + ", ray, begin_m, length_m);";
      visit += " if (" + c + " < cameras) visit(" + c + ", forms[" + c +
               "], length_m, now, holds[" + c + "], agreed, state);";
      held += " held = held && (" + c + " >= cameras || holds[" + c + "] > now.s + now.delta);";
    }
  } else {
    prepare =
        "Form forms[kCameras]; for (int c = 0; c < cameras; ++c) { holds[c] = -1.0; forms[c] = "
        "form_of(c, ray, begin_m, length_m); }";
    held = "for (int c = 0; c < cameras && held; ++c) held = holds[c] > now.s + now.delta;";
    visit =
        "for (int c = 0; c < cameras; ++c) visit(c, forms[c], length_m, now, holds[c], agreed, "
        "state);";
  }
  return of_view("const int kCameras = " + std::to_string(max_cameras) + ";\n#define PREPARE " +
                 prepare + "\n#define VISIT " + visit + "\n#define HELD " + held + "\n" + kRays);
}
std::string resolve_exact_source() { return of_view(kResolveExact); }

}  // namespace fivepipe::hull::gl_hull
