#include "sim_node/simulation/simulation_clock.h"

namespace fivepipe::sim {
namespace {

// Timestamps are whole nanoseconds: a step that ends at most this long after one belongs to it.
constexpr double kStampResolution_s = 1e-9;

}  // namespace

void SimulationClock::set(double time_s) {
  anchor_s_ = time_s;
  steps_since_anchor_ = 0;
  started_ = true;
}

std::uint64_t SimulationClock::advance_to(double time_s) {
  if (!started_ || paused_) {
    set(time_s);
    return 0;
  }
  if (time_s < this->time_s() - kStampResolution_s) {
    ++counters_.backward_stamps;
    if (time_s < this->time_s() - kMaxCatchUp_s) set(time_s);
    return 0;
  }
  if (const double gap_s = time_s - this->time_s(); gap_s > kMaxCatchUp_s + step_s_) {
    counters_.skipped_s += gap_s - kMaxCatchUp_s;
    set(time_s - kMaxCatchUp_s);
  }
  std::uint64_t steps = 0;
  while (anchor_s_ + double(steps_since_anchor_ + 1) * step_s_ <= time_s + kStampResolution_s) {
    ++steps_since_anchor_;
    ++steps;
  }
  return steps;
}

}  // namespace fivepipe::sim
