// The methods that the hull benchmark times. Each computes the depth of a whole view from packed
// maps, preparation included.
#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "benchmarks/hull/scenes.h"

namespace fivepipe::hull_bench {

struct Method {
  std::string name;  // "cpu", "sweep64"
  int threads;
  bool exact;  // returns the exact hull; compared with backend cpu in every pixel
  // Writes the depth of the whole view. May keep buffers from call to call, but no results.
  std::function<void(const HullScene&, const hull::View&, std::span<float> depth_m)> depth;
  // The largest depth error in mm that the method's discretisation explains. A hit that is deeper
  // by more has missed the first piece of the hull. 0: no such limit.
  std::function<double(const hull::View&)> spacing_mm = [](const hull::View&) { return 0.0; };
  std::function<bool(const HullScene&)> supports = [](const HullScene&) { return true; };
};

// fivepipe's backends.
Method cpu_method(int threads);
Method gl_method(int threads);  // needs a current OpenGL context; llvmpipe uses `threads`
// Baselines.
Method image_based_method(int threads);  // Matusik et al. 2000
// The paper's plane sweep with SIMD. `centered` returns the depth halfway to the previous plane.
Method cpu_sweep_method(int planes, bool centered, int threads);
// The same, centered, but it tests every plane within the hull's bounds.
Method plain_sweep_method(int planes, int threads);
Method carving_method(double voxel_mm, int threads);
Method gl_sweep_method(int planes, int threads);  // the paper's plane sweep on OpenGL

}  // namespace fivepipe::hull_bench
