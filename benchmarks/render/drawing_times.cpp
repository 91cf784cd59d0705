#include "benchmarks/render/drawing_times.h"

#include <chrono>
#include <cmath>
#include <ctime>
#include <opencv2/core.hpp>

#include "common/base/timing.h"
#include "render_node/renderer.h"

namespace fivepipe::render_bench {
namespace {

using Clock = std::chrono::steady_clock;

double cpu_ms() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * double(t.tv_sec) + 1e-6 * double(t.tv_nsec);
}

// FNV-1a, 64 bits.
std::uint64_t mixed(std::uint64_t sum, const cv::Mat& image) {
  for (int v = 0; v < image.rows; ++v)
    for (const std::uint8_t* byte = image.ptr(v);
         byte < image.ptr(v) + image.cols * int(image.elemSize()); ++byte)
      sum = (sum ^ *byte) * 0x100000001b3;
  return sum;
}

}  // namespace

config::Deployment with(config::Deployment deployment, const Variant& variant) {
  deployment.scene.lights_real_objects = variant.lit;
  if (variant.shadows)
    deployment.scene.shadows =
        config::ShadowView{.target_world_m = {0, 0, 0.1}, .fov_rad = 50 * M_PI / 180};
  if (variant.particles) deployment.scene.particles.resize(1);
  return deployment;
}

DrawingTimes measured_times(const config::Deployment& deployment, const std::vector<Frame>& frames,
                            int rounds) {
  render::Renderer renderer(deployment.scene, deployment.viewer);
  DrawingTimes times{{}, {}, {}, {}, 0xcbf29ce484222325};
  for (int i = -kFrames; i < rounds * kFrames; ++i) {  // the checksum is of the warm-up round
    const Frame& frame = frames[std::size_t((i + kFrames) % kFrames)];
    const auto particles = particles_of(deployment.scene, i + kFrames);
    const double cpu_before_ms = cpu_ms();
    const Clock::time_point start = Clock::now();
    renderer.draw(frame.hull, {}, {"touched_block"}, particles,
                  frame.light_hull ? &*frame.light_hull : nullptr);
    renderer.finish();
    const double draw_ms = 1e3 * base::seconds_since(start);
    const cv::Mat image = renderer.image_bgr();
    const double frame_ms = 1e3 * base::seconds_since(start),
                 frame_cpu_ms = cpu_ms() - cpu_before_ms;
    if (i < 0) {
      times.checksum = mixed(times.checksum, image);
      continue;
    }
    times.draw_ms.push_back(draw_ms);
    times.read_ms.push_back(frame_ms - draw_ms);
    times.frame_ms.push_back(frame_ms);
    times.cpu_ms.push_back(frame_cpu_ms);
  }
  return times;
}

}  // namespace fivepipe::render_bench
