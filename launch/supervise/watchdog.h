// Decides from its heartbeat whether a process is stalled. Pure: knows no clock and no process.
#pragma once
#include <cstdint>
#include <string>

namespace fivepipe::launch {

struct WatchdogSettings {
  // A process beats ten times per second. A pause of 150 ms, or one busy loop per core, must not
  // make it late (tests/system/stalled_node_test.cpp).
  double no_heartbeat_s = 1.0;
  // The main loop of a node that has handled a frame. One round handles several frames if they have
  // piled up.
  double stalled_loop_s = 30.0;
};

class Watchdog {
 public:
  explicit Watchdog(WatchdogSettings settings = {}) : settings_(settings) {}

  // Call at least every kMaxStep_s. process, loop: of base::Beats. elapsed_s: since the last call;
  // more than kMaxStep_s counts as kMaxStep_s, because the supervisor, and so perhaps the whole
  // machine, was paused too. handles_frames: the node has handled a frame, so that its loop no
  // longer waits for a start. Returns why the process is stalled; empty: it runs, it starts, or it
  // ends.
  std::string step(std::uint64_t process, std::uint64_t loop, double elapsed_s,
                   bool handles_frames);

  static constexpr double kMaxStep_s = 0.1;

 private:
  WatchdogSettings settings_;
  std::uint64_t process_ = 0, loop_ = 0;
  double silent_s_ = 0, stalled_s_ = 0;
};

}  // namespace fivepipe::launch
