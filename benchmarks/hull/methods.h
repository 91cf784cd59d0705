// Everything that the hull benchmark times: depth of a whole view from packed maps, all preparation
// included.
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
  bool exact;  // held to the exact hull, pixel by pixel
  // Buffers may be kept from call to call, results may not. depth_m: of the whole view.
  std::function<void(const HullScene&, const hull::View&, std::span<float> depth_m)> depth;
  // The largest error [mm] that the method's own idea allows in a view, beyond which it has missed
  // what it found too late; 0: none.
  std::function<double(const hull::View&)> spacing_mm = [](const hull::View&) { return 0.0; };
  std::function<bool(const HullScene&)> takes = [](const HullScene&) { return true; };
};

// Ours.
Method cpu_method(int threads);
Method gl_method(int threads);  // needs a current context; threads are llvmpipe's
// Baselines.
Method image_based_method(int threads);  // Matusik et al. 2000
Method cpu_sweep_method(int planes, bool middle,
                        int threads);  // the paper's planes, in vector lanes
Method plain_sweep_method(int planes,
                          int threads);  // the same, every plane within bounds; depth in the middle
Method carving_method(double voxel_mm, int threads);
Method gl_sweep_method(int planes, int threads);  // the paper's, on OpenGL

}  // namespace fivepipe::hull_bench
