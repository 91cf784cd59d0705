// Declarations that the passes of the preparation share. The C++ side is gl_hull_shaders.h.
layout(local_size_x = 64) in;
layout(std430, binding = 3) buffer Strips {
  uint strip_groups[3], strip_count;
  uvec2 strips[];  // grid; strip in the row (low 16 bits) and row of strips (high 16 bits)
};

struct Grid {
  uint first_word, words_per_row, rows, unused;
};

layout(std430, binding = 2) readonly buffer Grids {
  Grid grids[];  // camera i has its pixels at 2i and its cells at 2i + 1
};
