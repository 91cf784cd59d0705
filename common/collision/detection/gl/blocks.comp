#version 450 core
// Accepts the blocks with a sample that is, or may be, in the hull, and splits those without a
// certain one. One invocation decides one block.
//! include "projection.glsl"
//! include "parts.glsl"
//! include "outputs.glsl"

layout(std430, binding = 1) readonly buffer Blocks { uvec4 blocks_in[]; };

void decide(uvec4 part) {
  if (part.w != 0u) accept(part, part.w);
  uvec2 state = states[part.x];
  if ((part.w & 0xffffu) != 0u) atomicMin(states[part.x].x, pass);
  else if (state.x >= pass && state.y >= pass)
    split_or_finish(part, int(part.z >> 24), triangles[part.x].finest);
}

void main() {
  uint items = min(blocks.items, room), step = 64u * gl_NumWorkGroups.x;
  for (uint i = gl_GlobalInvocationID.x; i < items; i += step) decide(blocks_in[i]);
}
