// The simulation's clock: converts the times of frame sets into fixed time steps.
#pragma once
#include <cstdint>

namespace fivepipe::sim {

class SimulationClock {
 public:
  struct Counters {
    std::uint64_t backward_stamps = 0;  // calls with a time before time_s()
    double skipped_s = 0;               // not simulated: the excess of gaps over kMaxCatchUp_s
  };

  explicit SimulationClock(double step_s) : step_s_(step_s) {}  // > 0

  // Advances the clock to time_s [s, any epoch] in whole steps and returns their number. The first
  // call only sets the clock. If more than kMaxCatchUp_s is due, the clock skips the rest. A time
  // before time_s() is ignored and counted; if it is more than kMaxCatchUp_s before time_s() (a
  // recording has restarted), it sets the clock instead.
  std::uint64_t advance_to(double time_s);

  // While paused, advance_to() sets the clock and returns 0, so the pause is not simulated later.
  void pause() { paused_ = true; }
  void resume() { paused_ = false; }

  double time_s() const { return anchor_s_ + double(steps_since_anchor_) * step_s_; }
  const Counters& counters() const { return counters_; }

 private:
  void set(double time_s);

  double step_s_;
  double anchor_s_ = 0;  // time_s() is the anchor plus whole steps: no accumulated rounding
  std::uint64_t steps_since_anchor_ = 0;
  bool started_ = false, paused_ = false;
  Counters counters_;
};

// Maximum time that one call simulates, so that a slow machine does not fall behind without bound.
inline constexpr double kMaxCatchUp_s = 0.25;

}  // namespace fivepipe::sim
