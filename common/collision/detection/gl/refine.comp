#version 450 core
// One pass over parts: drops, accepts, samples or splits each part. One invocation tests one part.
//! include "projection.glsl"
//! include "parts.glsl"
//! include "outputs.glsl"

layout(std430, binding = 1) writeonly buffer Blocks { uvec4 blocks_out[]; };
layout(std430, binding = 4) readonly buffer PartsIn { uvec4 parts_in[]; };
// Near a camera's plane float cannot locate images. A smaller part may be free in another camera,
// so a part below the sample grid is halved this many times before it is deferred to the CPU.
const int kMaxUncertainHalvings = 6;

// Appends a part to the blocks, which the sample pass tests.
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
  PartCoordinates at = coordinates_of(part, t);
  if (state.y < pass || at.level > t.sampled && state.x < pass) return;
  vec3 p0 = point(t, at.unit, at.a, at.b), p1 = point(t, at.unit, at.a + at.sigma, at.b),
       p2 = point(t, at.unit, at.a, at.b + at.sigma);
  float third = at.sigma / 3.0;
  vec3 center = point(t, at.unit, at.a + third, at.b + third);
  uint all = kSolid, center_in = kSolid;
  for (int i = 0; i < cameras && all != kFree; ++i) {
    all = min(all, classify_shape(maps[i], t.radius_m, p0, p1, p2));
    center_in = min(center_in, classify_point(maps[i], t.radius_m, center));
  }
  if (all == kFree) return;
  if (all == kSolid || at.level > t.sampled && center_in == kSolid) {
    atomicMin(states[part.x].x, pass);
    accept(part, all == kSolid ? kWholePartInHull : 1u);
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
}
