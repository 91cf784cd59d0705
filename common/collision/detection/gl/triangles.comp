#version 450 core
// Tests the triangles of the remaining leaves and appends those that are not free. One invocation
// tests one triangle. A leaf is 16 triangles: by vertex, by axis.
//! include "projection.glsl"
//! include "objects.glsl"

layout(std430, binding = 5) readonly buffer Leaves { uvec2 open_leaves[]; };
layout(std430, binding = 6) buffer Open { uint open_count, unused; uvec2 open_triangles[]; };

vec3 vertex(uint word) { return vec3(trees[word], trees[word + 16u], trees[word + 32u]); }

uint classify_triangle(uint first_camera, vec3 p0, vec3 p1, vec3 p2) {
  uint all = kSolid;
  for (uint i = 0u; i < uint(cameras); ++i) {
    uint found = classify_shape(object_cameras[first_camera + i], 0.0, p0, p1, p2);
    if (found == kFree) return kFree;
    all = min(all, found);
  }
  return all;
}

void main() {
  uint items = 16u * leaves.items, step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) {
    uvec2 leaf = open_leaves[i >> 4];
    uint place = 16u * leaf.y + (i & 15u),
         word = objects[leaf.x].first_leaf_word + 144u * leaf.y + (i & 15u);
    if (place >= objects[leaf.x].triangles) continue;
    uint found = classify_triangle(objects[leaf.x].first_camera, vertex(word), vertex(word + 48u),
                                   vertex(word + 96u));
    if (found != kFree)
      open_triangles[atomicAdd(open_count, 1u)] =
          uvec2(leaf.x, found == kSolid ? place | 0x80000000u : place);
  }
}
