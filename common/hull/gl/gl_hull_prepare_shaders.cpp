#include "common/hull/gl/gl_hull_shaders.h"

namespace fivepipe::hull::gl_hull {
namespace {

const char* const kVersion = "#version 450 core\n";

const char* const kGrids = R"(
layout(local_size_x = 64) in;
layout(std430, binding = 3) buffer Strips { uint strip_groups[3], strip_count; uvec2 strips[]; };  // grid; strip and row of strips
struct Grid { uint first_word, words_per_row, rows, unused; };
layout(std430, binding = 2) readonly buffer Grids { Grid grids[]; };  // of camera i: pixels at 2i, cells at 2i + 1
)";

// One word of cells: 32 cells of 8x8 pixels.
const char* const kCells = R"(
layout(std430, binding = 0) buffer Bits { uint bits[]; };
void main() {
  Grid pixels = grids[2 * gl_WorkGroupID.y], cells = grids[2 * gl_WorkGroupID.y + 1];
  uint row = gl_GlobalInvocationID.x / cells.words_per_row, word = gl_GlobalInvocationID.x % cells.words_per_row;
  if (row >= cells.rows) return;
  uint found = 0u;
  for (uint i = 0u; i < 8u; ++i) {
    uint column = 8u * word + i, any = 0u;
    if (column >= pixels.words_per_row) break;
    for (uint v = 8u * row; v < min(8u * row + 8u, pixels.rows); ++v) any |= bits[pixels.first_word + v * pixels.words_per_row + column];
    for (int cell = 0; cell < 4; ++cell)
      if ((any >> 8 * cell & 0xffu) != 0u) found |= 1u << 4u * i + uint(cell);
  }
  bits[cells.first_word + row * cells.words_per_row + word] = found;
})";

// Which strips of 16x8 pixels need distances: of the pixels, those that hold a cell with an object
// pixel in it or next to it; of the cells, all. One invocation per word of cells, as above.
const char* const kStrips = R"(
layout(std430, binding = 0) readonly buffer Bits { uint bits[]; };
void add(uint grid, uint strip, uint row) {
  uint i = atomicAdd(strip_count, 1u);
  strips[i] = uvec2(grid, strip | row << 16);
  if (i % 64u == 0u) atomicMax(strip_groups[0], i / 64u + 1u);
}
uint word_at(Grid g, int row, int word) {
  return row < 0 || row >= int(g.rows) || word < 0 || word >= int(g.words_per_row) ? 0u : bits[g.first_word + uint(row) * g.words_per_row + uint(word)];
}
void main() {
  uint grid = 2u * gl_WorkGroupID.y;
  Grid cells = grids[grid + 1u];
  uint row = gl_GlobalInvocationID.x / cells.words_per_row, word = gl_GlobalInvocationID.x % cells.words_per_row;
  if (row >= cells.rows) return;
  uint near = 0u;
  for (int i = -1; i <= 1; ++i) {
    uint own = word_at(cells, int(row) + i, int(word));
    near |= own | own << 1 | own >> 1 | word_at(cells, int(row) + i, int(word) - 1) >> 31 | word_at(cells, int(row) + i, int(word) + 1) << 31;
  }
  for (uint i = 0u; i < 16u; ++i)
    if ((near >> 2u * i & 3u) != 0u && 16u * word + i < 2u * grids[grid].words_per_row) add(grid, 16u * word + i, row);
  if (row % 8u == 0u) {
    add(grid + 1u, 2u * word, row / 8u);
    add(grid + 1u, 2u * word + 1u, row / 8u);
  }
})";

// Signed chessboard distances of 16x8 pixels, four bits each: bit 3 says object, the others how far
// (1 to 7, 7 meaning at least that) the nearest pixel of the other kind is. Planes of bits grow by
// one pixel six times; each pixel counts for how often it is not reached. A 32-bit window has 8
// spare pixels on either side, each growth spoils one at its ends.
const char* const kDistances = R"(
layout(std430, binding = 0) readonly buffer Bits { uint bits[]; };
layout(std430, binding = 1) writeonly buffer Distances { uint distances[]; };
const int kGrowths = 6, kRows = 8, kWindow = kRows + 2 * kGrowths;
uint word_at(Grid g, int row, int word) {
  bool there = row >= 0 && row < int(g.rows) && word >= 0 && word < int(g.words_per_row);
  uint found = bits[g.first_word + (there ? uint(row) * g.words_per_row + uint(word) : 0u)];
  return there ? found : 0u;
}
uint spread(uint x) {  // 8 bits to the lowest of 8 nibbles
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
  uint window[kWindow], here[kRows], low[kRows], middle[kRows], high[kRows];
  for (int i = 0; i < kWindow; ++i) {
    int row = first_row + i - kGrowths;
    uint own = word_at(g, row, word), beside = word_at(g, row, right ? word + 1 : word - 1);
    window[i] = right ? own >> 8 | beside << 24 : own << 8 | beside >> 24;
  }
  for (int i = 0; i < kRows; ++i) {
    here[i] = window[i + kGrowths];
    low[i] = ~0u;
    middle[i] = high[i] = 0u;
  }
  for (int kind = 0; kind < 2; ++kind) {
    uint grown[kWindow];
    for (int i = 0; i < kWindow; ++i) grown[i] = kind == 0 ? window[i] : ~window[i];
    for (int growth = 1; growth <= kGrowths; ++growth) {
      for (int i = 0; i < kWindow; ++i) grown[i] |= grown[i] << 1 | grown[i] >> 1;
      uint above = grown[0];
      for (int i = 1; i + 1 < kWindow; ++i) {
        uint own = grown[i];
        grown[i] |= above | grown[i + 1];
        above = own;
      }
      for (int i = 0; i < kRows; ++i) {  // add one where not reached, in a sliced three-bit counter
        uint carry = ~grown[i + kGrowths], next = low[i] & carry;
        low[i] ^= carry;
        carry = middle[i] & next;
        middle[i] ^= next;
        high[i] |= carry;
      }
    }
  }
  uint to = 4u * (g.first_word + uint(first_row) * g.words_per_row) + 2u * strip;
  for (int i = 0; i < kRows; ++i) {
    if (first_row + i < int(g.rows)) {
      distances[to] = spread(low[i] >> 8 & 0xffu) | spread(middle[i] >> 8 & 0xffu) << 1 | spread(high[i] >> 8 & 0xffu) << 2 | spread(here[i] >> 8 & 0xffu) << 3;
      distances[to + 1u] = spread(low[i] >> 16 & 0xffu) | spread(middle[i] >> 16 & 0xffu) << 1 | spread(high[i] >> 16 & 0xffu) << 2 | spread(here[i] >> 16 & 0xffu) << 3;
    }
    to += 4u * g.words_per_row;
  }
})";

}  // namespace

std::string cells_source() { return std::string(kVersion) + kGrids + kCells; }
std::string strips_source() { return std::string(kVersion) + kGrids + kStrips; }
std::string distances_source() { return std::string(kVersion) + kGrids + kDistances; }

}  // namespace fivepipe::hull::gl_hull
