// Tiles and uncertain rays: written by one pass over a view, read by the next. The C++ side is
// gl_hull_shaders.h.
struct Tile {
  double begin_m;
  float length_m;
  uint at_near, corner, rays, leaves_box, unused;
};

layout(std430, binding = 2) buffer Tiles { Tile tiles[]; };
layout(std430, binding = 3) buffer Work {
  uint tile_groups[3], tile_count, ray_groups[3], ray_count, uncertain[];
};

const uint kGroupsPerRow = 64u, kMaxRayGroups = 32768u;
// Leaves a ray to the pass in double precision.
void set_aside(uint u, uint v) {
  uint i = atomicAdd(ray_count, 1u);
  uncertain[i] = u | v << 16;
  if (i % 64u == 0u) atomicMax(ray_groups[0], min(i / 64u + 1u, kMaxRayGroups));
}
