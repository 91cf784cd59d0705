#version 450 core
//! variant -DCAMERAS=4
//! variant -DCAMERAS=16
//! variant -DCAMERAS=64
// One workgroup handles the rays of one tile, one invocation per ray, in float from the tile's
// start. Each map's pixels are counted from the one in which the ray starts, so that numbers are
// small; the forms of the ray's images are computed in double and rounded once.
//
// Bound of float's rounding. A map pixel computed in float is within e (error_px) of the true one
// at every depth of the range: of U, V and W the offset is rounded once, the slope once, product
// and sum once each, which is 3 units (half an ulp) of |offset| + length |slope|; the quotient U /
// W has 2.5 ulp for GLSL's division and half of one for the product, which is 6 units, and 8 with
// all second-order terms. A depth is the crossing of a border by one map's image at speed v [px/m];
// it is within delta = 3 e / v: e for the offset, e for the slope, at most 5/3 e for the division.
// Another map then sees its pixel within e + delta v'. Rays keep four times that distance from
// every border that may part object from background (distance +-1); nearer rays are left to the
// pass in double. The factor is four, because then each crossing is more than 3 delta beyond the
// last, and a verdict of another map at an earlier depth stays certain.
//! include "view.glsl"
//! include "work.glsl"
//! include "clip.glsl"

const int kCameras = CAMERAS;  // maximum; `cameras` is the actual number
layout(local_size_x = 8, local_size_y = 8) in;
layout(r32f, binding = 0) writeonly uniform image2D depth_m;
const float kCrossingErrors = 3.0, kTolerance = 4.0;
const float kUnit = 5.9604645e-8, kFormUnits = 3.0, kQuotientUnits = 8.0;  // half an ulp of 1
// A ray's computed pixel is at most one pixel from the true one; boxes of distance 2 hold both.
const float kWidestTolerance_px = 0.5;
const float kMaxFormError_px = 1.0 / 64.0;  // forms with a larger error decide too few pixels
const float kNever = 1e30;
const float kFarthest_px = 1e6;  // bound of Form::first, beyond any map
// Covers float's rounding of the length; main() compares with the far plane in double.
const float kLengthSlack = 1.0 + 1e-6;
// Maximum consecutive steps with one camera, because another camera may end the search in fewer.
const int kMaxRepeats = 8;
const int kMaxRounds = 64;  // rays that need more are left to the pass in double
const int kActive = 0, kHit = 1, kMiss = 2, kUncertain = 3;

// Image of the ray in one map: (U, V, W) at the tile's start, and its slope per metre. Pixels are
// relative to `first`. error_px bounds the error of a computed pixel.
struct Form {
  vec3 start, slope;
  ivec2 first;
  float error_px;
};

Form form_of(int c, dvec2 ray, double begin_m, float length_m) {
  dvec3 slope = slope_of(c, ray), start = maps[c].eye.xyz + begin_m * slope;
  vec2 first = floor(clamp(vec2(start.xy) / float(start.z), -kFarthest_px, kFarthest_px));
  Form f;
  f.first = ivec2(first);
  f.start = vec3(start - dvec3(dvec2(first), 0.0lf) * start.z);
  f.slope = vec3(slope - dvec3(dvec2(first), 0.0lf) * slope.z);
  vec3 size = abs(f.start) + length_m * abs(f.slope), last = f.start + length_m * f.slope;
  float min_w = min(f.start.z, last.z), reach_px = 2.0 + max(abs(last.x), abs(last.y)) / last.z;
  f.error_px = kUnit * (kFormUnits * (max(size.x, size.y) + reach_px * size.z) / min_w +
                        kQuotientUnits * reach_px);
  if (!(min_w > 0.0 && f.error_px < kMaxFormError_px)) f.error_px = kFarthest_px;
  return f;
}

// The first depth that may be in the hull, and the crossing that set it.
struct Candidate {
  float s, delta;  // depth from the tile's start [m], bound of its error [m]
  // Camera whose image crossed `border` along `axis` (0: u, 1: v) into pixel `entered`; camera -1:
  // the tile's start.
  int camera, axis, entered, border;
};

// Tests the candidate with one camera. Returns kMiss, kUncertain or kActive. If kActive, either
// `now` has moved on, or the camera sees the object at `now`, up to depth `holds`.
int test_camera(int c, Form f, float length_m, inout Candidate now, inout float holds) {
  vec3 at = f.start + now.s * f.slope;
  float inverse = 1.0 / at.z;
  vec2 uv = clamp(at.xy * inverse, -kFarthest_px, kFarthest_px), whole = floor(uv);
  vec2 speed = (f.slope.xy - uv * f.slope.z) * inverse;
  // Above 0.5: within the tolerance of a pixel border.
  vec2 off = abs(uv - whole - 0.5) + kTolerance * (f.error_px + now.delta * abs(speed));
  bvec2 known = bvec2(now.camera == c && now.axis == 0, now.camera == c && now.axis == 1),
        forward = greaterThan(speed, vec2(0.0));
  ivec2 pixel = mix(ivec2(whole) + f.first, ivec2(now.entered), known);
  off = mix(off, vec2(0.0), known);
  Region region = region_around(c, pixel);
  if (!(max(off.x, off.y) < (abs(region.distance) == 1 ? 0.5 : 0.5 + kWidestTolerance_px)))
    return kUncertain;

  // Border and depth at which the image leaves the region. The verdict `object` ends kTolerance
  // errors before that border.
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
  float delta = kCrossingErrors * f.error_px * (f.start.z + s * f.slope.z) /
                abs((along_u ? f.slope.x : f.slope.y) - crossed * f.slope.z);
  if (!(s - delta < length_m)) return kMiss;
  if (!(delta < length_m)) return kUncertain;
  int at_border = int(crossed) + (along_u ? f.first.x : f.first.y);
  now = Candidate(s, delta, c, along_u ? 0 : 1,
                  (along_u ? forward.x : forward.y) ? at_border : at_border - 1, at_border);
  return kActive;
}

// Repeats test_camera() while the camera moves the candidate on.
void visit(int c, Form form, float length_m, inout Candidate now, inout float holds,
           inout bool agreed, inout int state) {
  if (state != kActive || holds > now.s + now.delta) return;
  for (int repeat = 0; repeat < kMaxRepeats; ++repeat) {
    float before = now.s;
    holds = -1.0;
    state = test_camera(c, form, length_m, now, holds);
    if (state != kActive || now.s == before) break;
    agreed = false;
  }
}

// The steps of first_in_hull() over all cameras. For at most 4 cameras they are unrolled with
// constant indices, so that the ray's forms stay in registers: 15 % faster on llvmpipe. For 16
// cameras this is no faster and takes seconds to compile.
#if CAMERAS == 4
#define PREPARE(c) \
  holds[c] = -1.0; \
  if (c < cameras) forms[c] = form_of(c, ray, begin_m, length_m);
#define VISIT(c) \
  if (c < cameras) visit(c, forms[c], length_m, now, holds[c], agreed, state);
#define HELD(c) held = held && (c >= cameras || holds[c] > now.s + now.delta);
#define PREPARE_ALL PREPARE(0) PREPARE(1) PREPARE(2) PREPARE(3)
#define VISIT_ALL VISIT(0) VISIT(1) VISIT(2) VISIT(3)
#define HELD_ALL HELD(0) HELD(1) HELD(2) HELD(3)
#else
#define PREPARE_ALL                                \
  for (int c = 0; c < cameras; ++c) {              \
    holds[c] = -1.0;                               \
    forms[c] = form_of(c, ray, begin_m, length_m); \
  }
#define VISIT_ALL \
  for (int c = 0; c < cameras; ++c) visit(c, forms[c], length_m, now, holds[c], agreed, state);
#define HELD_ALL \
  for (int c = 0; c < cameras && held; ++c) held = holds[c] > now.s + now.delta;
#endif

// Moves the candidate on until all cameras agree. Returns kHit, kMiss or kUncertain.
int first_in_hull(double begin_m, float length_m, dvec2 ray, out Candidate now) {
  float holds[kCameras];
  Form forms[kCameras];
  PREPARE_ALL
  now = Candidate(0.0, 0.0, -1, 0, 0, 0);
  int state = kActive;
  for (int round = 0; round < kMaxRounds; ++round) {
    bool agreed = true;
    VISIT_ALL
    if (state != kActive) return state;
    bool held = true;  // every verdict holds beyond the candidate
    HELD_ALL
    if (agreed || held) return kHit;
  }
  return kUncertain;
}

// Computes the depth of the crossing in double.
double depth_of(Candidate hit, dvec2 ray) {
  dvec3 eye = maps[hit.camera].eye.xyz, slope = slope_of(hit.camera, ray);
  double border = double(hit.border);
  return (border * eye.z - (hit.axis == 0 ? eye.x : eye.y)) /
         ((hit.axis == 0 ? slope.x : slope.y) - border * slope.z);
}

// Returns whether the ray is in the rule's box at depth t. The first hull point of other rays is
// found from where they enter the box.
bool is_in_box(dvec2 ray, double t) {
  range = range_m.xy;
  clip_to_box(ray);
  return range.x <= t && t <= range.y;
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
    if (tile.leaves_box != 0u && !is_in_box(dvec2(ray), t)) {
      set_aside(ray.x, ray.y);
      return;
    }
    if (t < range_m.y) depth = float(t);
  }
  imageStore(depth_m, ivec2(ray), vec4(depth, 0.0, 0.0, 0.0));
}
