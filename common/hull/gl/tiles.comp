#version 450 core
// One invocation handles one tile. It clips the tile's rays to where every map can see its object,
// moves their common start on while the images of the corner rays lie in one empty box (then the
// images of all rays between them do), and outputs the tile if a range remains.
//! include "view.glsl"
//! include "work.glsl"
//! include "clip.glsl"
//! include "tile_clip.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Candidates { uvec2 candidates[]; };
layout(location = 1) uniform uint candidate_count;
// Images keep this distance from a box's border [px], so that no ray starts next to a pixel border.
const double kBorderMargin_px = 1.0lf / 32.0lf;
const int kMaxSteps = 48;
const float kBeyond_px = 1e30;
// Returns a depth >= t up to which none of the tile's rays meets the object in map c, or t if that
// is not known.
double free_depth(int c, dvec2 corner, double t) {
  dvec3 eye = maps[c].eye.xyz, column = kSpan * maps[c].column.xyz, row = kSpan * maps[c].row.xyz,
        first = slope_of(c, corner);
  dvec2 uv[4], center = dvec2(0.0lf);
  for (int k = 0; k < 4; ++k) {
    dvec3 at = eye + t * (first + double(k & 1) * column + double(k >> 1) * row);
    if (!(at.z > 0.0lf)) return t;
    uv[k] = at.xy / at.z;
    center += 0.25lf * uv[k];
  }
  ivec2 size = maps[c].pixels.wz, pixel = ivec2(floor(clamp(center, dvec2(-1.0lf), dvec2(size))));
  Region free = region_around(c, pixel);
  if (free.distance < 2) return t;
  // There is no object beyond the crop.
  dvec2 low =
      dvec2(mix(low_of(free), vec2(-kBeyond_px), lessThan(pixel, ivec2(0)))) + kBorderMargin_px;
  dvec2 high =
      dvec2(mix(high_of(free), vec2(kBeyond_px), greaterThanEqual(pixel, size))) - kBorderMargin_px;
  double end = range_m.y;
  for (int k = 0; k < 4; ++k) {
    if (!(uv[k].x > low.x && uv[k].y > low.y && uv[k].x < high.x && uv[k].y < high.y)) return t;
    dvec3 slope = first + double(k & 1) * column + double(k >> 1) * row;
    double w = eye.z + t * slope.z;
    dvec2 speed = slope.xy - uv[k] * slope.z;  // [px/m] times W
    dvec2 border = dvec2(speed.x > 0.0lf ? high.x : low.x, speed.y > 0.0lf ? high.y : low.y);
    dvec2 after = (border - uv[k]) * w / (slope.xy - border * slope.z);
    if (after.x > 0.0lf) end = min(end, t + after.x);
    if (after.y > 0.0lf) end = min(end, t + after.y);
    if (slope.z < 0.0lf) end = min(end, -eye.z / slope.z * (1.0lf - kSlack));
  }
  return max(end, t);
}

// Moves the start of the range on while any map finds the tile empty ahead.
void move_on(dvec2 corner) {
  for (int i = 0, c = 0, stuck = 0; i < kMaxSteps && stuck < cameras && range.x < range.y; ++i) {
    double end = free_depth(c, corner, range.x);
    stuck = end > range.x ? 0 : stuck + 1;
    range.x = end;
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
  uint leaves_box = clip_to_box_of_tile(corner);
  if (!(range.x < range.y)) return;
  bool at_near = range.x == range_m.x;
  range =
      dvec2(max(range_m.x, range.x * (1.0lf - kSlack)), min(range_m.y, range.y * (1.0lf + kSlack)));
  double begin = range.x;
  move_on(corner);
  if (!(range.x < range.y)) return;
  uint i = atomicAdd(tile_count, 1u);
  if (i % kGroupsPerRow == 0u) atomicAdd(tile_groups[1], 1u);
  tiles[i] = Tile(range.x, float(range.y - range.x), at_near && range.x == begin ? 1u : 0u,
                  candidate.x, candidate.y, leaves_box, 0u);
}
