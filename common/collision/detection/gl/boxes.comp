#version 450 core
// Descends the BVHs by one level: drops the free boxes and appends the nodes or leaves below the
// others. One invocation tests one box. A node is 16 boxes: centers by axis, then half sizes.
//! include "projection.glsl"
//! include "objects.glsl"

// Items are (object << 8 | level, index), and (object, leaf).
layout(std430, binding = 5) readonly buffer NodesIn { uvec2 nodes_in[]; };
layout(std430, binding = 6) writeonly buffer NodesOut { uvec2 nodes_out[]; };
layout(std430, binding = 7) writeonly buffer Leaves { uvec2 open_leaves[]; };
layout(location = 2) uniform int pass;
// Relative enlargement of a box's extent in the image, for its rounding. If a corner is
// (dU, dV, dW) away from the center, its image differs from the center's image uv by
// (dU - uv dW) / W, and by U - uv W of the center over the corner's W, which is the error of the
// forms and of the quotient.
const float kExtentSlack = 1.0 + 1.0 / 262144.0;

bool is_free(uint first_camera, vec3 center, vec3 half_size) {
  for (int i = 0; i < cameras; ++i) {
    Camera c = object_cameras[first_camera + uint(i)];
    vec3 uvw = project(c, center);
    float off_w = abs(c.of_x.z) * half_size.x + abs(c.of_y.z) * half_size.y +
                  abs(c.of_z.z) * half_size.z,
          min_w = uvw.z - off_w - c.of_y.w;
    if (uvw.z + off_w < c.behind * c.of_x.w) return true;
    if (!(min_w > 0.0)) continue;
    vec2 uv = uvw.xy / uvw.z;
    // The center's image may be farther off than the object pixels while the box extends to them.
    float far_px = max(c.farthest_px, max(abs(uv.x), abs(uv.y)));
    float margin =
        (c.of_x.w + (far_px - c.farthest_px) * c.of_y.w + far_px * c.of_z.w * uvw.z) / min_w;
    if (!(margin < max_margin_px)) continue;
    precise vec2 x = c.of_x.xy - uv * c.of_x.z, y = c.of_y.xy - uv * c.of_y.z,
                 z = c.of_z.xy - uv * c.of_z.z;
    vec2 off = (abs(x) * half_size.x + abs(y) * half_size.y + abs(z) * half_size.z) *
               (kExtentSlack / min_w);
    if (classify_rect(c, uv - off, uv + off, margin) == kFree) return true;
  }
  return false;
}

void main() {
  uint items = 16u * nodes[pass].items, step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) {
    uvec2 node = nodes_in[i >> 4];
    uint object = node.x >> 8, level = node.x & 255u, child = i & 15u;
    uint word = objects[object].first_box_word[level] + 96u * node.y + child;
    vec3 half_size = vec3(trees[word + 48u], trees[word + 64u], trees[word + 80u]);
    if (half_size.x < 0.0) continue;  // absent child
    vec3 center = vec3(trees[word], trees[word + 16u], trees[word + 32u]);
    if (is_free(objects[object].first_camera, center, half_size)) continue;
    uvec2 below = uvec2(level == 0u ? object : node.x - 1u, 16u * node.y + child);
    if (level == 0u) {
      uint at = atomicAdd(leaves.items, 1u);
      open_leaves[at] = below;
      if (at % 4u == 0u) atomicMax(leaves.groups_x, min(at / 4u + 1u, kMaxGroups));
    } else {
      uint at = atomicAdd(nodes[pass + 1].items, 1u);
      nodes_out[at] = below;
      if (at % 4u == 0u) atomicMax(nodes[pass + 1].groups_x, min(at / 4u + 1u, kMaxGroups));
    }
  }
}
