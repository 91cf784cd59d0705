#version 450 core
// Limits::seen. One invocation handles one tile: it outputs the tile with the range of depths in
// which enough cameras may see its rays on their objects.
//! include "view.glsl"
//! include "work.glsl"
//! include "clip.glsl"
//! include "tile_clip.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Candidates { uvec2 candidates[]; };
layout(location = 1) uniform uint candidate_count;

// Depths in which a camera may see a ray of the tile on its object; empty if x >= y.
dvec2 on_object[kMaxCameras];
// Sets `range` to the part of in_box from the first to the last depth at which min_seen of the
// ranges overlap.
// That many overlap first where a range begins, and last where one ends.
void clip_to_overlap(dvec2 in_box) {
  int min_seen = int(range_m.z);
  range = min_seen > 0 ? in_box.yx : in_box;
  for (int c = 0; c < cameras && min_seen > 0; ++c) {
    dvec2 own = on_object[c];
    if (!(own.x < own.y)) continue;
    int at_begin = 0, at_end = 0;
    for (int other = 0; other < cameras; ++other) {
      dvec2 r = on_object[other];
      if (r.x <= own.x && own.x < r.y) ++at_begin;
      if (r.x < own.y && own.y <= r.y) ++at_end;
    }
    if (at_begin >= min_seen) range.x = min(range.x, own.x);
    if (at_end >= min_seen) range.y = max(range.y, own.y);
  }
}

void main() {
  if (gl_GlobalInvocationID.x >= candidate_count) return;
  uvec2 candidate = candidates[gl_GlobalInvocationID.x];
  dvec2 corner = dvec2(candidate.x & 0xffffu, candidate.x >> 16);
  range = range_m.xy;
  clip_to_box_of_tile(corner);
  dvec2 in_box = range;
  for (int c = 0; c < cameras; ++c) {
    range = in_box;
    if (range.x < range.y) clip_to_map(c, corner);
    on_object[c] = range;
  }
  clip_to_overlap(in_box);
  if (!(range.x < range.y)) return;
  range =
      dvec2(max(range_m.x, range.x * (1.0lf - kSlack)), min(range_m.y, range.y * (1.0lf + kSlack)));
  uint i = atomicAdd(tile_count, 1u);
  if (i % kGroupsPerRow == 0u) atomicAdd(tile_groups[1], 1u);
  tiles[i] = Tile(range.x, float(range.y - range.x), 0u, candidate.x, candidate.y, 0u, 0u);
}
