// Outputs of the passes over parts: parts with a point that is or may be in the hull, and parts of
// the next level.
layout(std430, binding = 5) writeonly buffer PartsOut { uvec4 parts_out[]; };
layout(std430, binding = 6) buffer Found {
  uint found_count, split_count, overflow, unused;
  uvec4 found_parts[];
};

void accept(uvec4 part, uint found) {
  uint at = atomicAdd(found_count, 1u);
  if (at < room) found_parts[at] = uvec4(part.xyz, found);
  else overflow = 1u;
}

// Appends the quarters of a part: one at each corner, and an inverted one in the center.
void split(uvec4 part) {
  uint at = atomicAdd(parts[pass + 1u].items, 4u);
  if (at + 4u > room) {
    overflow = 1u;
    return;
  }
  atomicAdd(split_count, 1u);
  bool down = (part.y & kDown) != 0u;
  uint turned = part.y & kDown, a = 2u * (part.y & ~kDown), next_a = down ? a - 1u : a + 1u;
  uint level = (part.z >> 24) + 1u << 24, b = 2u * (part.z & 0xffffffu),
       next_b = (down ? b - 1u : b + 1u) | level;
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
