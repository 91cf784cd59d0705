#include "common/collision/gl_contact_shaders.h"

namespace fivepipe::gl_contact {
namespace {

// What all passes share: a rectangle of images looked up in a camera's map, as contact_lanes.h. What margins rest on is `precise`: GLSL then
// rounds sums and products as IEEE does; of a quotient it promises 2.5 units in the last place.
const char* const kShared = R"(#version 450 core
layout(local_size_x = 64) in;
struct Camera { vec4 of_x, of_y, of_z, at, stored, bounds; int first_byte, stride; float farthest_px, behind; };
layout(std430, binding = 0) readonly buffer Reaches { uint reaches[]; };
layout(location = 0) uniform int cameras;
layout(location = 1) uniform float most_margin_px;
struct Dispatch { uint groups_x, groups_y, groups_z, items; };
const uint kFree = 0u, kMixed = 1u, kSolid = 2u, kUnsure = 3u;
const uint kMostGroups = 32768u;

vec3 image_of(Camera c, vec3 p) {  // (U, V, W)
  precise vec3 uvw = c.at.xyz + p.x * c.of_x.xyz + p.y * c.of_y.xyz + p.z * c.of_z.xyz;
  return uvw;
}
float error_of(Camera c, float radius_m) { return c.of_x.w + radius_m * c.at.w; }
// How far images are off where W is least_w or more [px].
float margin_px(Camera c, float error, float least_w) { return error / least_w + c.farthest_px * c.of_z.w; }
float reach_at(Camera c, vec2 pixel) {  // of one in store
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
  float longer = max(size.x, size.y), side = max(min(size.x, size.y), ceil(0.5 * longer)), reach = reach_at(c, first);
  if (!(abs(reach) >= side)) return kMixed;
  if (side < longer) {
    float next = reach_at(c, in_store(c, first + mix(vec2(0.0), size - side, greaterThan(size, size.yx))));
    if (!(abs(next) >= side) || next < 0.0 != reach < 0.0) return kMixed;
  }
  return reach < 0.0 ? kSolid : kFree;
}
// One camera's say on what is convex, with these corners, radius_m from the origin at most.
uint ask(Camera c, float radius_m, vec3 p0, vec3 p1, vec3 p2) {
  vec3 q0 = image_of(c, p0), q1 = image_of(c, p1), q2 = image_of(c, p2);
  float error = error_of(c, radius_m), least_w = min(q0.z, min(q1.z, q2.z));
  if (max(q0.z, max(q1.z, q2.z)) < c.behind * error) return kFree;
  float margin = least_w > 0.0 ? margin_px(c, error, least_w) : 1.0;
  if (!(margin < most_margin_px)) return kUnsure;
  vec2 uv0 = q0.xy / q0.z, uv1 = q1.xy / q1.z, uv2 = q2.xy / q2.z;
  return look(c, min(uv0, min(uv1, uv2)), max(uv0, max(uv1, uv2)), margin);
}
// Of one that says not free; kUnsure, kMixed, kSolid: the least certain counts.
uint worse(uint a, uint b) { return a == kUnsure || b == kUnsure ? kUnsure : min(a, b); }
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
// A box's extent in the image, as a fraction more: the rounding of quotients, of its middle's image included, which errs with U and W alike.
const float kOffSlack = 1.0 + 1.0 / 262144.0;
bool is_free(uint first_camera, vec3 middle, vec3 half_size) {
  for (int i = 0; i < cameras; ++i) {
    Camera c = object_cameras[first_camera + uint(i)];
    vec3 uvw = image_of(c, middle);
    float off_w = abs(c.of_x.z) * half_size.x + abs(c.of_y.z) * half_size.y + abs(c.of_z.z) * half_size.z, least_w = uvw.z - off_w;
    if (uvw.z + off_w < c.behind * c.of_x.w) return true;
    if (!(least_w > 0.0)) continue;
    vec2 uv = uvw.xy / uvw.z;
    // The middle's image may be farther off than the object pixels, and the box reach from there to them.
    float beyond_px = max(0.0, max(abs(uv.x), abs(uv.y)) - c.farthest_px);
    float margin = margin_px(c, c.of_x.w + beyond_px * c.of_y.w, least_w) + beyond_px * c.of_z.w;
    if (!(margin < most_margin_px)) continue;
    precise vec2 x = c.of_x.xy - uv * c.of_x.z, y = c.of_y.xy - uv * c.of_y.z, z = c.of_z.xy - uv * c.of_z.z;
    vec2 off = (abs(x) * half_size.x + abs(y) * half_size.y + abs(z) * half_size.z) * (kOffSlack / least_w);
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
      if (at % 4u == 0u) atomicMax(leaves.groups_x, min(at / 4u + 1u, kMostGroups));
    } else {
      uint at = atomicAdd(nodes[pass + 1].items, 1u);
      nodes_out[at] = below;
      if (at % 4u == 0u) atomicMax(nodes[pass + 1].groups_x, min(at / 4u + 1u, kMostGroups));
    }
  }
})";

// One invocation a triangle. A leaf is sixteen triangles: by vertex, by axis.
const char* const kTriangles = R"(
layout(std430, binding = 5) readonly buffer Leaves { uvec2 open_leaves[]; };
layout(std430, binding = 6) writeonly buffer Open { uvec2 open_triangles[]; };
vec3 vertex(uint word) { return vec3(trees[word], trees[word + 16u], trees[word + 32u]); }
uint look_at_triangle(uint first_camera, vec3 p0, vec3 p1, vec3 p2) {
  uint all = kSolid;
  for (uint i = 0u; i < uint(cameras); ++i) {
    uint found = ask(object_cameras[first_camera + i], 0.0, p0, p1, p2);
    if (found == kFree) return kFree;
    all = worse(all, found);
  }
  return all;
}
void main() {
  uint items = 16u * leaves.items, step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) {
    uvec2 leaf = open_leaves[i >> 4];
    uint place = 16u * leaf.y + (i & 15u), word = objects[leaf.x].first_leaf_word + 144u * leaf.y + (i & 15u);
    if (place >= objects[leaf.x].triangles) continue;
    uint found = look_at_triangle(objects[leaf.x].first_camera, vertex(word), vertex(word + 48u), vertex(word + 96u));
    if (found != kFree) open_triangles[atomicAdd(open, 1u)] = uvec2(leaf.x, found == kSolid ? place | 0x80000000u : place);
  }
})";

// One invocation a part: it is dropped, taken, sampled, or split in four. What a pass does to a part does not depend on the order in which the
// others come: only what earlier passes found of its triangle counts.
const char* const kRefine = R"(
layout(std140, binding = 0) uniform Cameras { Camera maps[64]; };
struct Triangle {
  vec3 v0; float per_start;
  vec3 v1; float radius_m;
  vec3 v2; int sampled;
  int rows, finest; uint unused_a, unused_b;
};
layout(std430, binding = 2) readonly buffer Triangles { Triangle triangles[]; };
layout(std430, binding = 3) buffer Refinement { Dispatch levels[25]; uint found_count, overflow; };
layout(std430, binding = 4) readonly buffer PartsIn { uvec4 parts_in[]; };
layout(std430, binding = 5) writeonly buffer PartsOut { uvec4 parts_out[]; };
layout(std430, binding = 6) writeonly buffer Found { uvec4 found_parts[]; };
layout(std430, binding = 7) coherent buffer States { uvec2 states[]; };  // found, left
layout(location = 2) uniform int level;
layout(location = 3) uniform float scale;  // 2^-level
layout(location = 4) uniform uint most_parts;
const int kMostUnsure = 6;  // a part that float is too coarse for is halved so often, then left to the CPU
const uint kDown = 0x80000000u, kAllOfIt = 0xffffffffu, kUndecided = 1000u;

vec3 point(Triangle t, float a, float b) {  // in units of this level
  float unit = t.per_start * scale;
  precise float at_a = a * unit, at_b = b * unit;
  precise vec3 p = t.v0 + at_a * (t.v1 - t.v0) + at_b * (t.v2 - t.v0);
  return p;
}
uint look_at_part(float radius_m, vec3 p0, vec3 p1, vec3 p2) {
  uint all = kSolid, found;
  LOOK
  return all;
}
// One camera's say on a part's samples, the middles of its rows * rows parts: of those in all, the ones that are in the hull for it or that it
// can't tell.
uint sampled_by(Camera c, Triangle t, float a, float b, float sigma, int rows, uint in_all, inout uint doubtful) {
  float step = sigma / float(rows), error = error_of(c, t.radius_m);
  uint bit = 1u;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < 2 * (rows - row) - 1; ++column, bit <<= 1) {
      if ((in_all & bit) == 0u) continue;
      float third = (column & 1) == 1 ? 2.0 / 3.0 : 1.0 / 3.0;
      vec3 uvw = image_of(c, point(t, a + step * (float(column >> 1) + third), b + step * (float(row) + third)));
      float margin = uvw.z > 0.0 ? margin_px(c, error, uvw.z) : 1.0;
      if (uvw.z < c.behind * error) {
        in_all &= ~bit;
        continue;
      }
      if (!(margin < most_margin_px)) {
        doubtful |= bit;
        continue;
      }
      vec2 uv = uvw.xy / uvw.z, pixel = floor(uv), off = uv - pixel;
      // Near a border the pixel beyond it may be another.
      if (min(off.x, off.y) < margin || max(off.x, off.y) > 1.0 - margin) doubtful |= bit;
      else if (reach_at(c, in_store(c, pixel)) > 0.0) in_all &= ~bit;
    }
  return in_all;
}
// Those in the hull, and, 16 bits above, those of which float can't tell.
uint sampled(Triangle t, float a, float b, float sigma, int rows) {
  uint in_all = rows == 4 ? 0xffffu : (1u << uint(rows * rows)) - 1u, doubtful = 0u;
  SAMPLE
  doubtful &= in_all;
  return in_all & ~doubtful | doubtful << 16;
}
void take(uvec4 part, uint found) {
  uint at = atomicAdd(found_count, 1u);
  if (at < most_parts) found_parts[at] = uvec4(part.xy, part.z | uint(level) << 24, found);
  else overflow = 1u;
}
void split(uvec4 part) {
  uint at = atomicAdd(levels[level + 1].items, 4u);
  if (at + 4u > most_parts) {
    overflow = 1u;
    return;
  }
  bool down = (part.y & kDown) != 0u;
  uint turned = part.y & kDown, a = 2u * (part.y & ~kDown), b = 2u * part.z, next_a = down ? a - 1u : a + 1u, next_b = down ? b - 1u : b + 1u;
  parts_out[at] = uvec4(part.x, a | turned, b, 0u);
  parts_out[at + 1u] = uvec4(part.x, next_a | turned, b, 0u);
  parts_out[at + 2u] = uvec4(part.x, a | turned, next_b, 0u);
  parts_out[at + 3u] = uvec4(part.x, next_a | (turned ^ kDown), next_b, 0u);
  if (at % 64u == 0u) atomicMax(levels[level + 1].groups_x, min(at / 64u + 1u, kMostGroups));
}
void refine(uvec4 part) {
  Triangle t = triangles[part.x];
  uvec2 state = states[part.x];
  if (state.y < uint(level) || level > t.sampled && state.x < uint(level)) return;
  float sigma = (part.y & kDown) != 0u ? -1.0 : 1.0, a = float(part.y & ~kDown), b = float(part.z);
  uint found = look_at_part(t.radius_m, point(t, a, b), point(t, a + sigma, b), point(t, a, b + sigma));
  if (found == kFree) return;
  if (found == kUnsure) {  // near a camera's plane: a smaller part may be free in the image of another
    if (level < kMostUnsure && (t.sampled < 0 || level < t.sampled)) split(part);
    else atomicMin(states[part.x].y, uint(level));
    return;
  }
  uint taken = 0u;
  if (found == kSolid) taken = kAllOfIt;
  else if (level >= t.sampled) taken = sampled(t, a, b, sigma, level == t.sampled ? t.rows : 1);
  bool sure = (taken & 0xffffu) != 0u;
  if (sure) atomicMin(states[part.x].x, uint(level));
  if (sure || level == t.sampled && taken != 0u) take(part, taken);
  if (sure && level >= t.sampled || found == kSolid) return;
  if (level >= t.finest) atomicMin(states[part.x].y, kUndecided);
  else split(part);
}
void main() {
  uint items = min(levels[level].items, most_parts), step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) refine(parts_in[i]);
})";

}  // namespace

std::string boxes_source() { return std::string(kShared) + kDescent + kBoxes; }
std::string triangles_source() { return std::string(kShared) + kDescent + kTriangles; }
std::string refine_source(bool unrolled) {
  const auto each_camera = [&](const std::string& statements) {  // with the camera's number as C
    const std::string loop = "for (int C = 0; C < cameras; ++C) { " + statements + " }";
    if (!unrolled) return loop;
    std::string all;
    for (std::size_t i = 0; i < kUnrolledCameras; ++i) {
      std::string one = "if (C < cameras) { " + statements + " } ";
      for (std::size_t at = 0; (at = one.find('C', at)) != std::string::npos;) one.replace(at, 1, std::to_string(i));
      all += one;
    }
    return all;
  };
  return std::string(kShared) + "#define LOOK " + each_camera("found = ask(maps[C], radius_m, p0, p1, p2); if (found == 0u) return 0u; all = worse(all, found);") +
         "\n#define SAMPLE " + each_camera("if (in_all != 0u) in_all = sampled_by(maps[C], t, a, b, sigma, rows, in_all, doubtful);") + "\n" + kRefine;
}

}  // namespace fivepipe::gl_contact
