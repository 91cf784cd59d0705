#version 450 core
// Lists the strips of 16x8 pixels whose distances the view passes need: of the pixels, the strips
// that overlap a set cell or a neighbour of a set cell; of the cells, all strips. One invocation
// handles one word of cells.
//! include "grids.glsl"

layout(std430, binding = 0) readonly buffer Bits { uint bits[]; };
void add(uint grid, uint strip, uint row) {
  uint i = atomicAdd(strip_count, 1u);
  strips[i] = uvec2(grid, strip | row << 16);
  if (i % 64u == 0u) atomicMax(strip_groups[0], i / 64u + 1u);
}

uint word_at(Grid g, int row, int word) {
  return row < 0 || row >= int(g.rows) || word < 0 || word >= int(g.words_per_row)
             ? 0u
             : bits[g.first_word + uint(row) * g.words_per_row + uint(word)];
}

void main() {
  uint grid = 2u * gl_WorkGroupID.y;
  Grid cells = grids[grid + 1u];
  uint row = gl_GlobalInvocationID.x / cells.words_per_row,
       word = gl_GlobalInvocationID.x % cells.words_per_row;
  if (row >= cells.rows) return;
  uint near = 0u;
  for (int i = -1; i <= 1; ++i) {
    uint current = word_at(cells, int(row) + i, int(word));
    near |= current | current << 1 | current >> 1 |
            word_at(cells, int(row) + i, int(word) - 1) >> 31 |
            word_at(cells, int(row) + i, int(word) + 1) << 31;
  }
  for (uint i = 0u; i < 16u; ++i)
    if ((near >> 2u * i & 3u) != 0u && 16u * word + i < 2u * grids[grid].words_per_row)
      add(grid, 16u * word + i, row);
  if (row % 8u == 0u) {
    add(grid + 1u, 2u * word, row / 8u);
    add(grid + 1u, 2u * word + 1u, row / 8u);
  }
}
