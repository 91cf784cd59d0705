// Decides from its heartbeat whether a process hangs. Pure: knows no clock and no process.
#pragma once
#include <cstdint>
#include <string>

namespace fivepipe::launch {

struct WatchdogSettings {
  // A process beats ten times per second. A pause of 150 ms, or two busy loops per core, delay it
  // by less than half of this.
  double silent_s = 1.0;
  // The main loop of a node that has handled a frame: longer than any frame takes.
  double stuck_s = 10.0;
};

class Watchdog {
 public:
  explicit Watchdog(WatchdogSettings settings = {}) : settings_(settings) {}

  // Call at least every kMaxStep_s. process, loop: of base::Beats. elapsed_s: since the last call;
  // more than kMaxStep_s counts as kMaxStep_s, because the supervisor, and so perhaps the whole
  // machine, was paused too. handles_frames: the node has handled a frame, so that its loop no
  // longer waits for a start. Returns why the process hangs; empty: it runs, it starts, or it ends.
  std::string step(std::uint64_t process, std::uint64_t loop, double elapsed_s,
                   bool handles_frames);

  static constexpr double kMaxStep_s = 0.1;

 private:
  WatchdogSettings settings_;
  std::uint64_t process_ = 0, loop_ = 0;
  double silent_s_ = 0, stuck_s_ = 0;
};

}  // namespace fivepipe::launch
