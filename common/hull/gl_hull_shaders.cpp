#include "common/hull/gl_hull_shaders.h"

namespace fivepipe::gl_hull {
namespace {

const char* const kVersion = "#version 450 core\n";

const char* const kGrids = R"(
layout(local_size_x = 64) in;
struct Grid { uint first_word, words_per_row, rows, unused; };
layout(std430, binding = 2) readonly buffer Grids { Grid grids[]; };  // of camera i: pixels at 2i, cells at 2i + 1
)";

// One word of cells: 32 cells of 8x8 pixels.
const char* const kCells = R"(
layout(std430, binding = 0) buffer Bits { uint bits[]; };
void main() {
  Grid pixels = grids[2 * gl_WorkGroupID.y], cells = grids[2 * gl_WorkGroupID.y + 1];
  uint row = gl_GlobalInvocationID.x / cells.words_per_row, word = gl_GlobalInvocationID.x % cells.words_per_row;
  if (row >= cells.rows) return;
  uint found = 0u;
  for (uint i = 0u; i < 8u; ++i) {
    uint column = 8u * word + i, any = 0u;
    if (column >= pixels.words_per_row) break;
    for (uint v = 8u * row; v < min(8u * row + 8u, pixels.rows); ++v) any |= bits[pixels.first_word + v * pixels.words_per_row + column];
    for (int cell = 0; cell < 4; ++cell)
      if ((any >> 8 * cell & 0xffu) != 0u) found |= 1u << 4u * i + uint(cell);
  }
  bits[cells.first_word + row * cells.words_per_row + word] = found;
})";

// Signed chessboard distances of 16x8 pixels, four bits each: bit 3 says object, the others how far (1 to 7, 7 meaning at
// least that) the nearest pixel of the other kind is. Planes of bits grow by one pixel six times; each pixel counts for how
// often it is not reached. A 32-bit window has 8 spare pixels on either side, each growth spoils one at its ends.
const char* const kDistances = R"(
layout(std430, binding = 0) readonly buffer Bits { uint bits[]; };
layout(std430, binding = 1) writeonly buffer Distances { uint distances[]; };
const int kGrowths = 6, kRows = 8, kWindow = kRows + 2 * kGrowths;
uint word_at(Grid g, int row, int word) {
  return row < 0 || row >= int(g.rows) || word < 0 || word >= int(g.words_per_row) ? 0u : bits[g.first_word + uint(row) * g.words_per_row + uint(word)];
}
uint spread(uint x) {  // 8 bits to the lowest of 8 nibbles
  x = (x | x << 12) & 0x000f000fu;
  x = (x | x << 6) & 0x03030303u;
  return (x | x << 3) & 0x11111111u;
}
void main() {
  Grid g = grids[gl_WorkGroupID.y];
  uint strips = 2u * g.words_per_row, strip = gl_GlobalInvocationID.x % strips;
  int first_row = kRows * int(gl_GlobalInvocationID.x / strips);
  if (first_row >= int(g.rows)) return;
  int word = int(strip / 2u);
  bool right = (strip & 1u) == 1u;
  uint window[kWindow], here[kRows], low[kRows], middle[kRows], high[kRows];
  for (int i = 0; i < kWindow; ++i) {
    int row = first_row + i - kGrowths;
    window[i] = right ? word_at(g, row, word) >> 8 | word_at(g, row, word + 1) << 24 : word_at(g, row, word) << 8 | word_at(g, row, word - 1) >> 24;
  }
  for (int i = 0; i < kRows; ++i) {
    here[i] = window[i + kGrowths];
    low[i] = ~0u;
    middle[i] = high[i] = 0u;
  }
  for (int kind = 0; kind < 2; ++kind) {
    uint grown[kWindow];
    for (int i = 0; i < kWindow; ++i) grown[i] = kind == 0 ? window[i] : ~window[i];
    for (int growth = 1; growth <= kGrowths; ++growth) {
      for (int i = 0; i < kWindow; ++i) grown[i] |= grown[i] << 1 | grown[i] >> 1;
      uint above = grown[0];
      for (int i = 1; i + 1 < kWindow; ++i) {
        uint own = grown[i];
        grown[i] |= above | grown[i + 1];
        above = own;
      }
      for (int i = 0; i < kRows; ++i) {  // add one where not reached, in a sliced three-bit counter
        uint carry = ~grown[i + kGrowths], next = low[i] & carry;
        low[i] ^= carry;
        carry = middle[i] & next;
        middle[i] ^= next;
        high[i] |= carry;
      }
    }
  }
  for (int i = 0; i < kRows; ++i) {
    if (first_row + i >= int(g.rows)) return;
    uint to = 4u * (g.first_word + uint(first_row + i) * g.words_per_row) + 2u * strip;
    for (int half_strip = 0; half_strip < 2; ++half_strip) {
      int shift = 8 + 8 * half_strip;
      distances[to + uint(half_strip)] = spread(low[i] >> shift & 0xffu) | spread(middle[i] >> shift & 0xffu) << 1 |
                                         spread(high[i] >> shift & 0xffu) << 2 | spread(here[i] >> shift & 0xffu) << 3;
    }
  }
})";

// What the passes over a view share: its maps, and how far a map is free around a pixel.
const char* const kView = R"(
layout(std430, binding = 1) readonly buffer Distances { uint distances[]; };
struct ViewMap { vec4 per_column, per_row; ivec4 bounds, pixels, cells; };
layout(std430, binding = 2) readonly buffer ViewMaps { ViewMap maps[]; };
// near and far [m]; then of each map (U, V, W) at the eye, and at infinity per view column, per view row and constant.
layout(std430, binding = 3) readonly buffer Exact { double exact[]; };
layout(location = 0) uniform int cameras;
dvec3 exact_at(int camera, int part) {
  int i = 2 + 12 * camera + 3 * part;
  return dvec3(exact[i], exact[i + 1], exact[i + 2]);
}

// The pixels of a box around one: all without object (distance > 0) or all object (< 0); +-1: next to the other kind.
struct Region { int distance; vec2 low, high; };
const float kBeyond_px = 1e30;
uint nibble(ivec4 grid, ivec2 at) { return distances[grid.x + at.y * grid.y + (at.x >> 3)] >> 4 * (at.x & 7) & 15u; }
Region region_around(int camera, ivec2 at) {
  ivec4 grid = maps[camera].pixels;
  if (at.x < 0 || at.y < 0 || at.x >= grid.w || at.y >= grid.z) {  // half the plane, up to the object's bounds
    ivec4 bounds = maps[camera].bounds;
    Region r = Region(kNoCell, vec2(-kBeyond_px), vec2(kBeyond_px));
    if (at.x < 0) r.high.x = float(bounds.x);
    else if (at.x >= grid.w) r.low.x = float(bounds.z);
    else if (at.y < 0) r.high.y = float(bounds.y);
    else r.low.y = float(bounds.w);
    return r;
  }
  uint code = nibble(grid, at);
  int distance = int(code & 7u);
  if (code == 7u) {
    ivec2 cell = at >> 3;
    int far = int(nibble(maps[camera].cells, cell));
    if (far > 1 && far < 8) return Region(kNoCell, vec2(8 * (cell - far + 1)), vec2(8 * (cell + far)));
  }
  return Region(code < 8u ? distance : -distance, vec2(at - distance + 1), vec2(at + distance));
}
)";

const char* const kWork = R"(
struct Tile { double begin_m; float length_m; uint at_near, corner, rays, unused_a, unused_b; };
layout(std430, binding = 4) buffer Tiles { Tile tiles[]; };
layout(std430, binding = 5) buffer TileMaps { vec4 tile_maps[]; };  // of each tile's maps: (U, V, W) at its start, per metre
layout(std430, binding = 6) buffer Work { uint tile_groups[3], tile_count, ray_groups[3], ray_count, doubtful[]; };
const uint kGroupsPerRow = 64u, kMostRayGroups = 32768u;
// Left to the pass in double.
void set_aside(uint u, uint v) {
  uint i = atomicAdd(ray_count, 1u);
  doubtful[i] = u | v << 16;
  if (i % 64u == 0u) atomicMax(ray_groups[0], min(i / 64u + 1u, kMostRayGroups));
}
)";

// One invocation per tile: clips its rays to where every map can see its object, moves them on together while the corner
// rays' images lie in one empty box (then so do all between), and hands on what is left, as forms for float lanes.
const char* const kTiles = R"(
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Candidates { uvec2 candidates[]; };
layout(location = 1) uniform uint candidate_count;
// Slack of the ranges shared by a tile, as a fraction: no ray's own range is cut by rounding.
const double kSlack = 1e-9lf;
const double kNearestToCamera_m = 1e-9lf;  // as map_from_view.h
// Boxes are kept this far from, so that rays don't start next to a pixel border [px].
const double kKeepOff_px = 1.0lf / 32.0lf;
const int kMostSteps = 48;
// Float rounding of a form that adds products of rounded numbers, in units of their magnitudes: a unit is half an ulp; three
// for the coefficients and seven operations. GLSL's division is good to 2.5 ulp, the multiplication behind it to half of one.
const double kUnit = 5.9604644775390625e-8lf, kFormUnits = 8.0lf, kDivisionUnits = 8.0lf;
// Forms worse than this are no use to float lanes [px].
const double kWorstForm_px = 1.0lf / 64.0lf;

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
  clip(at_eye + extra, constant + max(7.0lf * column, 0.0lf) + max(7.0lf * row, 0.0lf));
}
void clip_to_map(int c, dvec2 corner) {
  dvec3 eye = exact_at(c, 0), column = exact_at(c, 1), row = exact_at(c, 2);
  dvec3 first = column * corner.x + row * corner.y + exact_at(c, 3);
  dvec4 bounds = dvec4(maps[c].bounds);
  clip_tile(eye.z, column.z, row.z, first.z, -kNearestToCamera_m);
  clip_tile(eye.x - bounds.x * eye.z, column.x - bounds.x * column.z, row.x - bounds.x * row.z, first.x - bounds.x * first.z, 0.0lf);
  clip_tile(bounds.z * eye.z - eye.x, bounds.z * column.z - column.x, bounds.z * row.z - row.x, bounds.z * first.z - first.x, 0.0lf);
  clip_tile(eye.y - bounds.y * eye.z, column.y - bounds.y * column.z, row.y - bounds.y * row.z, first.y - bounds.y * first.z, 0.0lf);
  clip_tile(bounds.w * eye.z - eye.y, bounds.w * column.z - column.y, bounds.w * row.z - row.y, bounds.w * first.z - first.y, 0.0lf);
}
// Depth >= t up to which one map's object is on none of the tile's rays; t itself where that can't be said.
double free_until(int c, dvec2 corner, double t) {
  dvec3 eye = exact_at(c, 0), column = 7.0lf * exact_at(c, 1), row = 7.0lf * exact_at(c, 2);
  dvec3 first = exact_at(c, 1) * corner.x + exact_at(c, 2) * corner.y + exact_at(c, 3);
  dvec2 uv[4], middle = dvec2(0.0lf);
  for (int k = 0; k < 4; ++k) {
    dvec3 at = eye + t * (first + double(k & 1) * column + double(k >> 1) * row);
    if (!(at.z > 0.0lf)) return t;
    uv[k] = at.xy / at.z;
    middle += 0.25lf * uv[k];
  }
  ivec2 size = maps[c].pixels.wz;
  Region free = region_around(c, ivec2(floor(clamp(middle, dvec2(-1.0lf), dvec2(size)))));
  if (free.distance < 2) return t;
  double until = exact[1];
  for (int k = 0; k < 4; ++k) {
    dvec2 low = dvec2(free.low) + kKeepOff_px, high = dvec2(free.high) - kKeepOff_px;
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
  for (int i = 0, c = 0, stuck = 0; i < kMostSteps && stuck < cameras && range.x < range.y; ++i) {
    double until = free_until(c, corner, range.x);
    stuck = until > range.x ? 0 : stuck + 1;
    range.x = until;
    if (stuck > 0) c = c + 1 == cameras ? 0 : c + 1;
  }
}
// The largest error of a map pixel that float lanes compute anywhere in the tile and its range [px]; not a number, or huge,
// where the map camera's depth comes near zero.
double form_error_px(int c, dvec3 at, dvec3 slope, double length) {
  dvec3 column = exact_at(c, 1), row = exact_at(c, 2);
  dvec3 magnitude = abs(at) + 7.0lf * range.x * (abs(column) + abs(row)) + length * (abs(slope) + 7.0lf * (abs(column) + abs(row)));
  double least = at.z + min(7.0lf * range.x * column.z, 0.0lf) + min(7.0lf * range.x * row.z, 0.0lf);
  double least_slope = slope.z + min(7.0lf * column.z, 0.0lf) + min(7.0lf * row.z, 0.0lf);
  least = min(least, least + length * least_slope);
  double size = double(max(maps[c].pixels.w, maps[c].pixels.z));
  return least > 0.0lf ? kUnit * (kFormUnits * (max(magnitude.x, magnitude.y) + size * magnitude.z) / least + kDivisionUnits * size) : 1e9lf;
}
void main() {
  if (gl_GlobalInvocationID.x >= candidate_count) return;
  uvec2 candidate = candidates[gl_GlobalInvocationID.x];
  uvec2 at = uvec2(candidate.x & 0xffffu, candidate.x >> 16);
  dvec2 corner = dvec2(at);
  range = dvec2(exact[0], exact[1]);
  for (int c = 0; c < cameras; ++c) {
    clip_to_map(c, corner);
    if (!(range.x < range.y)) return;
  }
  bool at_near = range.x == exact[0];
  range = dvec2(max(exact[0], range.x * (1.0lf - kSlack)), min(exact[1], range.y * (1.0lf + kSlack)));
  double begin = range.x;
  move_on(corner);
  if (!(range.x < range.y)) return;
  if (range.x > begin) at_near = false;
  double length = range.y - range.x, worst_px = 0.0lf;
  for (int c = 0; c < cameras; ++c) {
    dvec3 slope = exact_at(c, 1) * corner.x + exact_at(c, 2) * corner.y + exact_at(c, 3);
    worst_px = max(worst_px, form_error_px(c, exact_at(c, 0) + range.x * slope, slope, length));
  }
  if (!(worst_px < kWorstForm_px)) {
    for (uint v = candidate.y >> 8 & 15u; v <= candidate.y >> 12; ++v)
      for (uint u = candidate.y & 15u; u <= (candidate.y >> 4 & 15u); ++u) set_aside(at.x + u, at.y + v);
    return;
  }
  uint i = atomicAdd(tile_count, 1u);
  if (i % kGroupsPerRow == 0u) atomicAdd(tile_groups[1], 1u);
  tiles[i] = Tile(range.x, float(length), at_near ? 1u : 0u, candidate.x, candidate.y, 0u, 0u);
  for (int c = 0; c < cameras; ++c) {
    dvec3 slope = exact_at(c, 1) * corner.x + exact_at(c, 2) * corner.y + exact_at(c, 3), start = exact_at(c, 0) + range.x * slope;
    int to = 2 * (int(i) * cameras + c);
    tile_maps[to] = vec4(vec3(start), float(form_error_px(c, start, slope, length)));
    tile_maps[to + 1] = vec4(vec3(slope), 0.0);
  }
})";

// One invocation per ray of the tiles that are left, in float from the tile's start.
//
// What float knows of a map pixel is within e (error_px, from the tile pass) for every depth of the tile. Depth itself, the
// crossing of a border by one map's image at speed v [px/m], is within delta = 3 e / v: e for the pixel, e for the slope's share,
// e for the division. Another map then sees its pixel within e + delta v'. Four times that is kept from every border that
// parts object from no object (distance +-1): nearer rays are set aside. Factor four: each next crossing lies more than 3 delta
// further on, so that what was certain of other maps from an earlier depth on stays so.
const char* const kRays = R"(
layout(local_size_x = 8, local_size_y = 8) in;
layout(r32f, binding = 0) writeonly uniform image2D depth_m;
const float kCrossingErrors = 3.0, kTolerance = 4.0;
const float kWidestTolerance_px = 0.5;
const int kMostRepeats = 8, kMostRounds = 64;
const int kGoing = 0, kHit = 1, kMiss = 2, kDoubtful = 3;

// Depth from the tile's start, how uncertain it is, and what set it: the border that an image crossed into pixel `entered`.
struct Candidate { float s, delta; int camera, axis, entered, border; };

vec2 crossings(float s, vec2 border_px, vec3 start, vec3 slope) {  // forward only
  vec2 at = (border_px * start.z - start.xy) / (slope.xy - border_px * slope.z);
  return mix(vec2(kBeyond_px), at, greaterThan(at, vec2(s)));
}
// Asks one camera; kGoing: `now` has moved on, or not (then the camera holds until `holds`).
int ask(int c, vec3 start, vec3 slope, float error_px, float length, inout Candidate now, inout float holds) {
  vec3 at = start + now.s * slope;
  float inverse = 1.0 / at.z;
  vec2 uv = at.xy * inverse;
  vec2 size = vec2(maps[c].pixels.wz);
  ivec2 pixel = ivec2(floor(clamp(uv, vec2(-1.0), size)));
  vec2 speed = (slope.xy - uv * slope.z) * inverse;
  vec2 tolerance = kTolerance * (error_px + now.delta * abs(speed));
  vec2 off = abs(fract(uv) - 0.5) + tolerance;  // > 0.5: next to a border
  if (now.camera == c) {
    if (now.axis == 0) {
      pixel.x = now.entered;
      uv.x = float(now.border);
      off.x = 0.0;
    } else {
      pixel.y = now.entered;
      uv.y = float(now.border);
      off.y = 0.0;
    }
  }
  Region region = region_around(c, pixel);
  float nearest = max(off.x, off.y);
  if (!(nearest < (abs(region.distance) == 1 ? 0.5 : 0.5 + kWidestTolerance_px))) return kDoubtful;
  bvec2 forward = greaterThan(speed, vec2(0.0));
  vec2 border = mix(region.low, region.high, forward);
  if (region.distance < 0) {
    vec2 ahead = mix(vec2(-1.0), vec2(1.0), forward);
    border -= ahead * kTolerance * error_px;
    vec2 until = crossings(now.s, border, start, slope);
    holds = all(greaterThan((border - uv) * ahead, vec2(0.0))) ? min(until.x, until.y) : now.s;
    return kGoing;
  }
  vec2 next = crossings(now.s, border, start, slope);
  bool along_u = next.x <= next.y;
  float s = along_u ? next.x : next.y, crossed = along_u ? border.x : border.y;
  if (!(s < length)) return kMiss;
  float delta = kCrossingErrors * error_px * (start.z + s * slope.z) / abs((along_u ? slope.x : slope.y) - crossed * slope.z);
  if (!(delta < length)) return kDoubtful;
  bool on = along_u ? forward.x : forward.y;
  now = Candidate(s, delta, c, along_u ? 0 : 1, on ? int(crossed) : int(crossed) - 1, int(crossed));
  return kGoing;
}
int first_in_hull(uint slot, Tile tile, vec2 from_corner, out Candidate now) {
  float holds[kCameras];
  for (int c = 0; c < kCameras; ++c) holds[c] = -1.0;
  now = Candidate(0.0, 0.0, -1, 0, 0, 0);
  float length = tile.length_m * (1.0 + 1e-6), begin = float(tile.begin_m);
  int state = kGoing;
  for (int round = 0; round < kMostRounds; ++round) {
    bool agreed = true;
    for (int c = 0; c < cameras; ++c) {
      if (holds[c] > now.s + now.delta) continue;
      vec3 per_pixel = maps[c].per_column.xyz * from_corner.x + maps[c].per_row.xyz * from_corner.y;
      int form = 2 * (int(slot) * cameras + c);
      vec4 start = tile_maps[form];
      vec3 slope = tile_maps[form + 1].xyz + per_pixel;
      start.xyz += begin * per_pixel;
      for (int repeat = 0; repeat < kMostRepeats; ++repeat) {
        float before = now.s;
        holds[c] = -1.0;
        state = ask(c, start.xyz, slope, start.w, length, now, holds[c]);
        if (state != kGoing) return state;
        if (now.s == before) break;
        agreed = false;
      }
    }
    if (agreed) return kHit;
  }
  return kDoubtful;
}
// The crossing again, in double.
double depth_of(Candidate hit, dvec2 ray) {
  dvec3 eye = exact_at(hit.camera, 0), slope = exact_at(hit.camera, 1) * ray.x + exact_at(hit.camera, 2) * ray.y + exact_at(hit.camera, 3);
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
  int state = first_in_hull(slot, tile, vec2(in_tile), hit);
  if (state == kHit && hit.camera < 0 && tile.at_near == 0u) state = kDoubtful;
  if (state == kDoubtful) {
    set_aside(ray.x, ray.y);
    return;
  }
  float depth = kNoHull;
  if (state == kHit) {
    double t = hit.camera < 0 ? exact[0] : depth_of(hit, dvec2(ray));
    if (t < exact[1]) depth = float(t);
  }
  imageStore(depth_m, ivec2(ray), vec4(depth, 0.0, 0.0, 0.0));
})";

// One invocation per doubtful ray, in double from its own start: the steps of exact_depth.cpp.
const char* const kSettle = R"(
layout(local_size_x = 64) in;
layout(r32f, binding = 0) writeonly uniform image2D depth_m;
const double kNearestToCamera_m = 1e-9lf, kOnBorder_px = 1e-8lf;  // as map_from_view.h and exact_depth.cpp
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
dvec3 slope_of(int c, dvec2 ray) { return exact_at(c, 1) * ray.x + (exact_at(c, 2) * ray.y + exact_at(c, 3)); }
int pixel(double offset, double slope, double w, double t, int least, int most) {
  double at = (offset + t * slope) / w;
  return !(at > double(least)) ? least : at >= double(most) ? most : int(at);
}
double crossing(double offset, double slope, double w_offset, double w_slope, double border, double t) {
  double at = (border * w_offset - offset) / (slope - border * w_slope);
  if (at > t) return at;
  double w = w_offset + t * w_slope;
  return abs(offset + t * slope - border * w) <= kOnBorder_px * w ? t : kNever;
}
double first_on_object(int c, dvec3 eye, dvec3 slope, double t, double end) {
  ivec4 bounds = maps[c].bounds;
  bool right = slope.x * eye.z > eye.x * slope.z, down = slope.y * eye.z > eye.y * slope.z;
  double w = eye.z + t * slope.z;
  int u = pixel(eye.x, slope.x, w, t, bounds.x, bounds.z - 1), v = pixel(eye.y, slope.y, w, t, bounds.y, bounds.w - 1);
  while (u >= bounds.x && v >= bounds.y && u < bounds.z && v < bounds.w) {
    Region free = region_around(c, ivec2(u, v));
    if (free.distance < 0) return t;
    double at_u = crossing(eye.x, slope.x, eye.z, slope.z, double(right ? free.high.x : free.low.x), t);
    double at_v = crossing(eye.y, slope.y, eye.z, slope.z, double(down ? free.high.y : free.low.y), t);
    t = min(at_u, at_v);
    if (!(t < end)) return kNever;
    w = eye.z + t * slope.z;
    if (at_u <= at_v) {
      u = right ? int(free.high.x) : int(free.low.x) - 1;
      v = pixel(eye.y, slope.y, w, t, int(free.low.y), int(free.high.y) - 1);
    } else {
      v = down ? int(free.high.y) : int(free.low.y) - 1;
      u = pixel(eye.x, slope.x, w, t, int(free.low.x), int(free.high.x) - 1);
    }
  }
  return kNever;
}
double first_in_hull(dvec2 ray) {
  range = dvec2(exact[0], exact[1]);
  for (int c = 0; c < cameras && range.x < range.y; ++c) {
    dvec3 eye = exact_at(c, 0), slope = slope_of(c, ray);
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
    double at = first_on_object(c, exact_at(c, 0), slope_of(c, ray), t, range.y);
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
  return kVersion + std::string("const int kNoCell = 99;\nconst float kNoHull = 0.0;\n") + kView + kWork + passes;
}

}  // namespace

std::string cells_source() { return std::string(kVersion) + kGrids + kCells; }
std::string distances_source() { return std::string(kVersion) + kGrids + kDistances; }
std::string tiles_source() { return of_view(kTiles); }
std::string rays_source(int most_cameras) { return of_view("const int kCameras = " + std::to_string(most_cameras) + ";\n" + kRays); }
std::string settle_source() { return of_view(kSettle); }

}  // namespace fivepipe::gl_hull
