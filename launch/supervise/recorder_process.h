// Runs `fivepipe record` beside a deployment, from before the first node starts until after the
// last one has ended.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/process.h"

namespace fivepipe::launch {

class RecorderProcess {
 public:
  // Starts `fivepipe record` with these arguments and waits until it listens or a signal arrives
  // (interrupt.h). Throws std::runtime_error with its output if it does not listen within 10 s.
  RecorderProcess(bus::Bus& bus, std::vector<std::string> arguments);

  void forward_output();
  bool ended() { return child_.ended().has_value(); }
  // Sends SIGTERM and waits for the end: at most 30 s, 1.5 s after one signal (interrupt.h), not at
  // all after two. Then kills the recorder. Forwards its last output to stderr and returns its exit
  // code; 1 if it was killed.
  int finish();

 private:
  ChildProcess child_;
};

}  // namespace fivepipe::launch
