// Times of drawing and reading back the frames of the suite.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "benchmarks/render/frames.h"

namespace fivepipe::render_bench {

// A feature of the scene, on top of those that it has.
struct Variant {
  std::string name;  // "coloured"
  bool coloured = true, lit = false, shadows = false, particles = false;
};
config::Deployment with(config::Deployment deployment, const Variant& variant);

struct DrawingTimes {
  std::vector<double> draw_ms, read_ms, frame_ms;
  // CPU time of the whole process, including llvmpipe's threads. Other processes affect it less
  // than the wall time.
  std::vector<double> cpu_ms;
  std::uint64_t checksum;  // of all images
};

// Draws all frames once to warm up, then `rounds` times. Needs a current GL context.
DrawingTimes measured_times(const config::Deployment& deployment, const std::vector<Frame>& frames,
                            int rounds);

}  // namespace fivepipe::render_bench
