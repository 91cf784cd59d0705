#version 450 core
// Tests the samples of the blocks: the centers of a block's rows * rows cells, at most 16. One
// invocation tests one sample. It sets bit i of the block's w if sample i is in the hull, and bit
// 16 + i if float cannot decide.
//! include "projection.glsl"
//! include "parts.glsl"

layout(std430, binding = 1) coherent buffer Blocks { uvec4 blocks_in[]; };

void classify_sample(uint block, int number) {
  uvec4 part = blocks_in[block];
  Triangle t = triangles[part.x];
  PartCoordinates at = coordinates_of(part, t);
  int row = 0, column = number;
  for (int i = 0; i < 3; ++i)
    if (column >= 2 * (t.rows - row) - 1 && row < t.rows) column -= 2 * (t.rows - row++) - 1;
  if (row >= t.rows || states[part.x].y < pass) return;
  float step = at.sigma / float(t.rows), third = (column & 1) == 1 ? 2.0 / 3.0 : 1.0 / 3.0;
  vec3 p = point(t, at.unit, at.a + step * (float(column >> 1) + third),
                 at.b + step * (float(row) + third));
  uint all = kSolid;
  for (int i = 0; i < cameras && all != kFree; ++i)
    all = min(all, classify_point(maps[i], t.radius_m, p));
  if (all != kFree)
    atomicOr(blocks_in[block].w, 1u << uint(all == kSolid ? number : 16 + number));
}

void main() {
  uint items = 16u * min(blocks.items, room), step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step)
    classify_sample(i >> 4, int(i & 15u));
}
