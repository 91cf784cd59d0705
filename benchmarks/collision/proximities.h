// Distances from virtual objects to the hull: certified bounds (proximity.h) against the distance
// transform of a voxel grid.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::collision_bench {

struct ProximityResult {
  std::string method, scene, setting;  // "proximity", "curtain720", "tol2mm-10000"
  int threads = 0;
  // Per run: all points, after the maps' preparation; each run rebuilds the octree or the grid.
  std::vector<double> ms = {};
  std::size_t points = 0, below_cap = 0;
  // max_m - min_m over the points below the cap: median and widest. nullopt if the method has no
  // bounds.
  std::optional<double> width_median_mm = {}, width_widest_mm = {};
  // Over a seeded subset with known distances, by the exact reference. error: the distance of the
  // bounds' midpoint from the reference. violations: bounds that exclude the reference.
  std::size_t known = 0, violations = 0;
  double error_median_mm = 0, error_worst_mm = 0;
  std::string name() const;  // with the threads
  double ms_per_1000() const;
};

// Measures points on the curtain of scene curtain720, seeded by area, and the vertices and
// triangles of scene payload's mesh. The cap is 5 cm. Takes some seconds.
std::vector<ProximityResult> measure_proximity(int threads, bool quick);
void print(const std::vector<ProximityResult>& results);  // to stdout

}  // namespace fivepipe::collision_bench
