#include "common/collision/detection/gl/gl_contact_shaders.h"

namespace fivepipe::collision::gl_contact {
namespace {

// What all passes share: a rectangle of images looked up in a camera's map, as contact_lanes.h.
// What margins rest on is `precise`: GLSL then rounds sums and products correctly, to whichever
// side; of a quotient it promises 2.5 units in the last place.
const char* const kShared = R"(#version 450 core
layout(local_size_x = 64) in;
struct Camera { vec4 of_x, of_y, of_z, at, stored, bounds; int first_byte, stride; float farthest_px, behind; };
layout(std430, binding = 0) readonly buffer Reaches { uint reaches[]; };
layout(location = 0) uniform int cameras;
layout(location = 1) uniform float max_margin_px;
struct Dispatch { uint groups_x, groups_y, groups_z, items; };
const uint kFree = 0u, kUncertain = 1u, kMixed = 2u, kSolid = 3u;  // of several cameras, the least counts
const uint kMaxGroups = 32768u;

vec3 image_of(Camera c, vec3 p) {  // (U, V, W)
  precise vec3 uvw = c.at.xyz + p.x * c.of_x.xyz + p.y * c.of_y.xyz + p.z * c.of_z.xyz;
  return uvw;
}
float error_of(Camera c, float radius_m) { return c.of_x.w + radius_m * c.at.w; }
// How far images are off where W is min_w or more [px].
float margin_px(Camera c, float error, float min_w) { return error / min_w + c.farthest_px * c.of_z.w; }
float extent_at(Camera c, vec2 pixel) {  // of one in store
  int i = c.first_byte + int(pixel.y) * c.stride + int(pixel.x);
  return float(bitfieldExtract(int(reaches[i >> 2]), 8 * (i & 3), 8));
}
vec2 in_store(Camera c, vec2 pixel) { return clamp(pixel, c.stored.xz, c.stored.yw); }
// One square, or two along the longer side.
uint look(Camera c, vec2 low, vec2 high, float margin) {
  low -= margin;
  high += margin;
  if (high.x < c.bounds.x || low.x > c.bounds.y || high.y < c.bounds.z || low.y > c.bounds.w) return kFree;
  vec2 first = in_store(c, floor(low)), size = floor(high) - first + 1.0;
  float longer = max(size.x, size.y), side = max(min(size.x, size.y), ceil(0.5 * longer)), extent = extent_at(c, first);
  if (!(abs(extent) >= side)) return kMixed;
  if (side < longer) {
    float next = extent_at(c, in_store(c, first + mix(vec2(0.0), size - side, greaterThan(size, size.yx))));
    if (!(abs(next) >= side) || next < 0.0 != extent < 0.0) return kMixed;
  }
  return extent < 0.0 ? kSolid : kFree;
}
// One camera's say on what is convex, with these corners, radius_m from the origin at most.
uint ask(Camera c, float radius_m, vec3 p0, vec3 p1, vec3 p2) {
  vec3 q0 = image_of(c, p0), q1 = image_of(c, p1), q2 = image_of(c, p2);
  float error = error_of(c, radius_m), min_w = min(q0.z, min(q1.z, q2.z));
  if (max(q0.z, max(q1.z, q2.z)) < c.behind * error) return kFree;
  float margin = min_w > 0.0 ? margin_px(c, error, min_w) : 1.0;
  if (!(margin < max_margin_px)) return kUncertain;
  vec2 uv0 = q0.xy / q0.z, uv1 = q1.xy / q1.z, uv2 = q2.xy / q2.z;
  return look(c, min(uv0, min(uv1, uv2)), max(uv0, max(uv1, uv2)), margin);
}
)";

const char* const kDescent = R"(
struct Object { uint first_box_word[8]; uint first_leaf_word, triangles, first_camera, unused; };
layout(std430, binding = 1) readonly buffer Cameras { Camera object_cameras[]; };
layout(std430, binding = 2) readonly buffer Objects { Object objects[]; };
layout(std430, binding = 3) readonly buffer Trees { float trees[]; };
layout(std430, binding = 4) buffer Descent { Dispatch nodes[9]; Dispatch leaves; uint open; };
)";

// One invocation a box. Nodes are sixteen boxes: middles by axis, then half sizes.
const char* const kBoxes = R"(
layout(std430, binding = 5) readonly buffer NodesIn { uvec2 nodes_in[]; };  // object << 8 | level, number
layout(std430, binding = 6) writeonly buffer NodesOut { uvec2 nodes_out[]; };
layout(std430, binding = 7) writeonly buffer Leaves { uvec2 open_leaves[]; };
layout(location = 2) uniform int pass;
// A box's extent in the image, as a fraction more, for its rounding. From the middle's image uv a corner, dU and dW away, lies off by
// (dU - uv dW) / W, and by U - uv W of the middle over the corner's W: that is what the forms and the quotient are off.
const float kExtentSlack = 1.0 + 1.0 / 262144.0;
bool is_free(uint first_camera, vec3 middle, vec3 half_size) {
  for (int i = 0; i < cameras; ++i) {
    Camera c = object_cameras[first_camera + uint(i)];
    vec3 uvw = image_of(c, middle);
    float off_w = abs(c.of_x.z) * half_size.x + abs(c.of_y.z) * half_size.y + abs(c.of_z.z) * half_size.z, min_w = uvw.z - off_w - c.of_y.w;
    if (uvw.z + off_w < c.behind * c.of_x.w) return true;
    if (!(min_w > 0.0)) continue;
    vec2 uv = uvw.xy / uvw.z;
    // The middle's image may be farther off than the object pixels, and the box extent from there to them.
    float far_px = max(c.farthest_px, max(abs(uv.x), abs(uv.y)));
    float margin = (c.of_x.w + (far_px - c.farthest_px) * c.of_y.w + far_px * c.of_z.w * uvw.z) / min_w;
    if (!(margin < max_margin_px)) continue;
    precise vec2 x = c.of_x.xy - uv * c.of_x.z, y = c.of_y.xy - uv * c.of_y.z, z = c.of_z.xy - uv * c.of_z.z;
    vec2 off = (abs(x) * half_size.x + abs(y) * half_size.y + abs(z) * half_size.z) * (kExtentSlack / min_w);
    if (look(c, uv - off, uv + off, margin) == kFree) return true;
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
    if (half_size.x < 0.0) continue;  // not there
    if (is_free(objects[object].first_camera, vec3(trees[word], trees[word + 16u], trees[word + 32u]), half_size)) continue;
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
})";

// One invocation a triangle. A leaf is sixteen triangles: by vertex, by axis.
const char* const kTriangles = R"(
layout(std430, binding = 5) readonly buffer Leaves { uvec2 open_leaves[]; };
layout(std430, binding = 6) writeonly buffer Open { uvec2 open_triangles[]; };
vec3 vertex(uint word) { return vec3(trees[word], trees[word + 16u], trees[word + 32u]); }
uint classify_triangle(uint first_camera, vec3 p0, vec3 p1, vec3 p2) {
  uint all = kSolid;
  for (uint i = 0u; i < uint(cameras); ++i) {
    uint found = ask(object_cameras[first_camera + i], 0.0, p0, p1, p2);
    if (found == kFree) return kFree;
    all = min(all, found);
  }
  return all;
}
void main() {
  uint items = 16u * leaves.items, step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) {
    uvec2 leaf = open_leaves[i >> 4];
    uint place = 16u * leaf.y + (i & 15u), word = objects[leaf.x].first_leaf_word + 144u * leaf.y + (i & 15u);
    if (place >= objects[leaf.x].triangles) continue;
    uint found = classify_triangle(objects[leaf.x].first_camera, vertex(word), vertex(word + 48u), vertex(word + 96u));
    if (found != kFree) open_triangles[atomicAdd(open, 1u)] = uvec2(leaf.x, found == kSolid ? place | 0x80000000u : place);
  }
})";

// What the passes over parts share. What a pass does to a part does not depend on the order in
// which the others come: only what earlier passes found of its triangle counts.
const char* const kParts = R"(
layout(std140, binding = 0) uniform Cameras { Camera maps[64]; };
struct Triangle {
  vec3 v0; float per_start;
  vec3 v1; float radius_m;
  vec3 v2; int sampled;
  int rows, finest; uint unused_a, unused_b;
};
layout(std430, binding = 2) readonly buffer Triangles { Triangle triangles[]; };
layout(std430, binding = 3) buffer Refinement { Dispatch parts[48]; Dispatch blocks, samples; uint found_count, overflow; };
layout(std430, binding = 7) coherent buffer States { uvec2 states[]; };  // when found, when left
layout(location = 2) uniform uint pass;
layout(location = 3) uniform uint room;
const uint kDown = 0x80000000u, kWholePartInHull = 0xffffffffu, kUndecided = 1000u;

// In units of the part's level.
struct PartCoordinates { float a, b, sigma, unit; int level; };
PartCoordinates place_of(uvec4 part, Triangle t) {
  uint level = part.z >> 24;
  float unit = t.per_start * uintBitsToFloat(127u - level << 23);  // 2^-level, exactly
  return PartCoordinates(float(part.y & ~kDown), float(part.z & 0xffffffu), (part.y & kDown) != 0u ? -1.0 : 1.0, unit, int(level));
}
vec3 point(Triangle t, float unit, float a, float b) {
  precise float at_a = a * unit, at_b = b * unit;
  precise vec3 p = t.v0 + at_a * (t.v1 - t.v0) + at_b * (t.v2 - t.v0);
  return p;
}
// One camera's say on a point: kFree, kSolid, or kMixed: float can't tell.
uint classify_point(Camera c, float radius_m, vec3 p) {
  vec3 uvw = image_of(c, p);
  float error = error_of(c, radius_m), margin = uvw.z > 0.0 ? margin_px(c, error, uvw.z) : 1.0;
  if (uvw.z < c.behind * error) return kFree;
  if (!(margin < max_margin_px)) return kMixed;
  vec2 uv = uvw.xy / uvw.z, pixel = floor(uv), off = uv - pixel;
  if (min(off.x, off.y) < margin || max(off.x, off.y) > 1.0 - margin) return kMixed;  // near a border the pixel beyond it may be another
  return extent_at(c, in_store(c, pixel)) > 0.0 ? kFree : kSolid;
}
)";

const char* const kOutputs = R"(
layout(std430, binding = 5) writeonly buffer PartsOut { uvec4 parts_out[]; };
layout(std430, binding = 6) writeonly buffer Found { uvec4 found_parts[]; };
void take(uvec4 part, uint found) {
  uint at = atomicAdd(found_count, 1u);
  if (at < room) found_parts[at] = uvec4(part.xyz, found);
  else overflow = 1u;
}
void split(uvec4 part) {
  uint at = atomicAdd(parts[pass + 1u].items, 4u);
  if (at + 4u > room) {
    overflow = 1u;
    return;
  }
  bool down = (part.y & kDown) != 0u;
  uint turned = part.y & kDown, a = 2u * (part.y & ~kDown), next_a = down ? a - 1u : a + 1u;
  uint level = (part.z >> 24) + 1u << 24, b = 2u * (part.z & 0xffffffu), next_b = (down ? b - 1u : b + 1u) | level;
  b |= level;
  parts_out[at] = uvec4(part.x, a | turned, b, 0u);
  parts_out[at + 1u] = uvec4(part.x, next_a | turned, b, 0u);
  parts_out[at + 2u] = uvec4(part.x, a | turned, next_b, 0u);
  parts_out[at + 3u] = uvec4(part.x, next_a | (turned ^ kDown), next_b, 0u);
  if (at % 64u == 0u) atomicMax(parts[pass + 1u].groups_x, min(at / 64u + 1u, kMaxGroups));
}
void split_or_finish(uvec4 part, int level, int finest) {
  if (level >= finest) atomicMin(states[part.x].y, kUndecided);
  else split(part);
}
)";

// One invocation a part: it is dropped, taken, put among those to be sampled, or split in four.
const char* const kRefine = R"(
layout(std430, binding = 1) writeonly buffer Blocks { uvec4 blocks_out[]; };
layout(std430, binding = 4) readonly buffer PartsIn { uvec4 parts_in[]; };
// Near a camera's plane float can't tell where images are. A smaller part may be free in the image of another camera: beyond the samples' grid
// it is halved so often, then left to the CPU.
const int kMaxUncertainHalvings = 6;
void defer_sampling(uvec4 part) {
  uint at = atomicAdd(blocks.items, 1u);
  if (at >= room) {
    overflow = 1u;
    return;
  }
  blocks_out[at] = part;
  if (at % 64u == 0u) atomicMax(blocks.groups_x, min(at / 64u + 1u, kMaxGroups));
  if (at % 4u == 0u) atomicMax(samples.groups_x, min(at / 4u + 1u, kMaxGroups));
}
void refine(uvec4 part) {
  uvec2 state = states[part.x];
  Triangle t = triangles[part.x];
  PartCoordinates at = place_of(part, t);
  if (state.y < pass || at.level > t.sampled && state.x < pass) return;
  vec3 p0 = point(t, at.unit, at.a, at.b), p1 = point(t, at.unit, at.a + at.sigma, at.b), p2 = point(t, at.unit, at.a, at.b + at.sigma);
  float third = at.sigma / 3.0;
  vec3 middle = point(t, at.unit, at.a + third, at.b + third);
  uint all = kSolid, center_in = kSolid;
  for (int i = 0; i < cameras && all != kFree; ++i) {
    all = min(all, ask(maps[i], t.radius_m, p0, p1, p2));
    center_in = min(center_in, classify_point(maps[i], t.radius_m, middle));
  }
  if (all == kFree) return;
  if (all == kSolid || at.level > t.sampled && center_in == kSolid) {
    atomicMin(states[part.x].x, pass);
    take(part, all == kSolid ? kWholePartInHull : 1u);
  } else if (at.level == t.sampled) {
    defer_sampling(part);
  } else if (all == kUncertain && at.level >= t.sampled + kMaxUncertainHalvings) {
    atomicMin(states[part.x].y, pass);
  } else {
    split_or_finish(part, at.level, t.finest);
  }
}
void main() {
  uint items = min(parts[pass].items, room), step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) refine(parts_in[i]);
})";

// One invocation a sample: the samples of a block are the middles of its rows * rows parts, sixteen
// at most. Bit i of what is found: sample i is in the hull; bit 16 + i: float can't tell.
const char* const kSample = R"(
layout(std430, binding = 1) coherent buffer Blocks { uvec4 blocks_in[]; };
void classify_sample(uint block, int number) {
  uvec4 part = blocks_in[block];
  Triangle t = triangles[part.x];
  PartCoordinates at = place_of(part, t);
  int row = 0, column = number;
  for (int i = 0; i < 3; ++i)
    if (column >= 2 * (t.rows - row) - 1 && row < t.rows) column -= 2 * (t.rows - row++) - 1;
  if (row >= t.rows || states[part.x].y < pass) return;
  float step = at.sigma / float(t.rows), third = (column & 1) == 1 ? 2.0 / 3.0 : 1.0 / 3.0;
  vec3 p = point(t, at.unit, at.a + step * (float(column >> 1) + third), at.b + step * (float(row) + third));
  uint all = kSolid;
  for (int i = 0; i < cameras && all != kFree; ++i) all = min(all, classify_point(maps[i], t.radius_m, p));
  if (all != kFree) atomicOr(blocks_in[block].w, 1u << uint(all == kSolid ? number : 16 + number));
}
void main() {
  uint items = 16u * min(blocks.items, room), step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) classify_sample(i >> 4, int(i & 15u));
})";

// One invocation a block: it is taken where some of its samples were, and split further where none
// is surely in the hull.
const char* const kSort = R"(
layout(std430, binding = 1) readonly buffer Blocks { uvec4 blocks_in[]; };
void sort(uvec4 part) {
  if (part.w != 0u) take(part, part.w);
  uvec2 state = states[part.x];
  if ((part.w & 0xffffu) != 0u) atomicMin(states[part.x].x, pass);
  else if (state.x >= pass && state.y >= pass) split_or_finish(part, int(part.z >> 24), triangles[part.x].finest);
}
void main() {
  uint items = min(blocks.items, room), step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) sort(blocks_in[i]);
})";

}  // namespace

std::string boxes_source() { return std::string(kShared) + kDescent + kBoxes; }
std::string triangles_source() { return std::string(kShared) + kDescent + kTriangles; }
std::string refine_source() { return std::string(kShared) + kParts + kOutputs + kRefine; }
std::string sample_source() { return std::string(kShared) + kParts + kSample; }
std::string sort_source() { return std::string(kShared) + kParts + kOutputs + kSort; }

}  // namespace fivepipe::collision::gl_contact
