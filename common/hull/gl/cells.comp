#version 450 core
// Computes coarse cells of 8x8 pixels from the object bits. One invocation computes one word, which
// is 32 cells. A cell is set if any of its pixels is an object pixel.
//! include "grids.glsl"

layout(std430, binding = 0) buffer Bits { uint bits[]; };
void main() {
  Grid pixels = grids[2 * gl_WorkGroupID.y], cells = grids[2 * gl_WorkGroupID.y + 1];
  uint row = gl_GlobalInvocationID.x / cells.words_per_row,
       word = gl_GlobalInvocationID.x % cells.words_per_row;
  if (row >= cells.rows) return;
  uint found = 0u;
  for (uint i = 0u; i < 8u; ++i) {
    uint column = 8u * word + i, any = 0u;
    if (column >= pixels.words_per_row) break;
    for (uint v = 8u * row; v < min(8u * row + 8u, pixels.rows); ++v)
      any |= bits[pixels.first_word + v * pixels.words_per_row + column];
    for (int cell = 0; cell < 4; ++cell)
      if ((any >> 8 * cell & 0xffu) != 0u) found |= 1u << 4u * i + uint(cell);
  }
  bits[cells.first_word + row * cells.words_per_row + word] = found;
}
