// Distances from virtual objects to the hull: certified bounds (proximity.h) against a voxel grid's
// distance transform.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::collision_bench {

struct ProximityResult {
  std::string method, scene, setting;  // proximity/curtain720/tol2mm-10000
  int threads = 0;
  std::vector<double> ms =
      {};  // of each run, all points; grids and cubes built anew, beyond the maps' preparation
  std::size_t points = 0, below_cap = 0;
  // most_m - least_m of points below the cap: median and widest; nothing for methods without
  // bounds.
  std::optional<double> width_median_mm = {}, width_widest_mm = {};
  // Of a seeded subset, against the exact reference. error: distance said (the bounds' middle) less
  // the reference's. violations: the bounds exclude it.
  std::size_t known = 0, violations = 0;
  double error_median_mm = 0, error_worst_mm = 0;
  std::string name() const;  // with threads
  double ms_per_1000() const;
};

// Points on the curtain of curtain720, seeded by area; the vertices and triangles of the payload's
// mesh (of_mesh). Cap 5 cm. Some seconds.
std::vector<ProximityResult> measure_proximity(int threads, bool quick);
void print(const std::vector<ProximityResult>& results);
std::string json_of(const ProximityResult& result);

}  // namespace fivepipe::collision_bench
