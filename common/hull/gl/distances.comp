#version 450 core
// Computes signed chessboard distances of 16x8 pixels, four bits each: bit 3 is set for an object
// pixel; bits 0 to 2 hold the distance to the nearest pixel of the other kind (1 to 7, where 7
// means at least 7).
//
// Each kind of pixel grows by one pixel six times, in bit planes. A pixel's distance is 1 plus the
// number of growths that do not reach it. A 32-bit window has 8 spare pixels on each side, because
// each of the six growths spoils one pixel at both ends.
//! include "grids.glsl"

layout(std430, binding = 0) readonly buffer Bits { uint bits[]; };
layout(std430, binding = 1) writeonly buffer Distances { uint distances[]; };
const int kGrowths = 6, kRows = 8, kWindow = kRows + 2 * kGrowths;
uint word_at(Grid g, int row, int word) {
  bool inside = row >= 0 && row < int(g.rows) && word >= 0 && word < int(g.words_per_row);
  uint found = bits[g.first_word + (inside ? uint(row) * g.words_per_row + uint(word) : 0u)];
  return inside ? found : 0u;
}

uint spread(uint x) {  // moves bit i of 8 bits to the lowest bit of nibble i
  x = (x | x << 12) & 0x000f000fu;
  x = (x | x << 6) & 0x03030303u;
  return (x | x << 3) & 0x11111111u;
}

void main() {
  if (gl_GlobalInvocationID.x >= strip_count) return;
  uvec2 task = strips[gl_GlobalInvocationID.x];
  Grid g = grids[task.x];
  uint strip = task.y & 0xffffu;
  int first_row = kRows * int(task.y >> 16);
  int word = int(strip / 2u);
  bool right = (strip & 1u) == 1u;
  uint window[kWindow], here[kRows], bit0[kRows], bit1[kRows], bit2[kRows];
  for (int i = 0; i < kWindow; ++i) {
    int row = first_row + i - kGrowths;
    uint current = word_at(g, row, word), neighbor = word_at(g, row, right ? word + 1 : word - 1);
    window[i] = right ? current >> 8 | neighbor << 24 : current << 8 | neighbor >> 24;
  }
  for (int i = 0; i < kRows; ++i) {
    here[i] = window[i + kGrowths];
    bit0[i] = ~0u;
    bit1[i] = bit2[i] = 0u;
  }
  for (int kind = 0; kind < 2; ++kind) {
    uint grown[kWindow];
    for (int i = 0; i < kWindow; ++i) grown[i] = kind == 0 ? window[i] : ~window[i];
    for (int growth = 1; growth <= kGrowths; ++growth) {
      for (int i = 0; i < kWindow; ++i) grown[i] |= grown[i] << 1 | grown[i] >> 1;
      uint above = grown[0];
      for (int i = 1; i + 1 < kWindow; ++i) {
        uint current = grown[i];
        grown[i] |= above | grown[i + 1];
        above = current;
      }
      // Increments the bit-sliced counter of every pixel that is not reached.
      for (int i = 0; i < kRows; ++i) {
        uint carry = ~grown[i + kGrowths], next = bit0[i] & carry;
        bit0[i] ^= carry;
        carry = bit1[i] & next;
        bit1[i] ^= next;
        bit2[i] |= carry;
      }
    }
  }
  uint to = 4u * (g.first_word + uint(first_row) * g.words_per_row) + 2u * strip;
  for (int i = 0; i < kRows; ++i) {
    if (first_row + i < int(g.rows)) {
      distances[to] = spread(bit0[i] >> 8 & 0xffu) | spread(bit1[i] >> 8 & 0xffu) << 1 |
                      spread(bit2[i] >> 8 & 0xffu) << 2 | spread(here[i] >> 8 & 0xffu) << 3;
      distances[to + 1u] = spread(bit0[i] >> 16 & 0xffu) | spread(bit1[i] >> 16 & 0xffu) << 1 |
                           spread(bit2[i] >> 16 & 0xffu) << 2 | spread(here[i] >> 16 & 0xffu) << 3;
    }
    to += 4u * g.words_per_row;
  }
}
