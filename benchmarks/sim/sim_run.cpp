#include "benchmarks/sim/sim_run.h"

#include <chrono>
#include <cmath>

#include "common/base/timing.h"

namespace fivepipe::sim_bench {

std::vector<geometry::Camera> cameras_at(int count, double height_m) {
  constexpr double kDistance_m = 3, kField_m = 1.0;
  constexpr int kImage_px = 500;
  std::vector<geometry::Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count;
    const double f_px = kImage_px * kDistance_m / kField_m, c_px = 0.5 * (kImage_px - 1);
    cameras.push_back(
        {{kImage_px, kImage_px, f_px, f_px, c_px, c_px},
         geometry::look_at({kDistance_m * std::cos(angle), kDistance_m * std::sin(angle), height_m},
                           {0, 0, height_m}, Eigen::Vector3d::UnitZ())});
  }
  return cameras;
}

void advance(sim::Simulation& simulation, int frame, std::span<const hull::Silhouette> silhouettes,
             Result& result) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  simulation.advance_to(frame * kFrame_s, silhouettes);
  if (frame == 0) return;  // only sets the clock
  result.frame_ms.push_back(1e3 * base::seconds_since(start));
  result.step_ms.push_back(result.frame_ms.back() / kStepsPerFrame);
}

}  // namespace fivepipe::sim_bench
