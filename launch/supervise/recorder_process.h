// `fivepipe record` beside a deployment: there before the first node starts, gone after the last
// has ended.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/process.h"

namespace fivepipe::launch {

class RecorderProcess {
 public:
  // What `fivepipe record` is to be called with. Waits until it listens, or a signal asks to end.
  // Throws std::runtime_error with what it said where it does not.
  RecorderProcess(bus::Bus& bus, std::vector<std::string> arguments);

  void forward_output();
  bool ended() { return child_.ended().has_value(); }
  // Ends it and waits, for 30 s at most, and hardly after a signal (launch/interrupt.h); then it is
  // killed. What it said last goes to stderr. Its exit code; 1 where it had to be killed.
  int finish();

 private:
  ChildProcess child_;
};

}  // namespace fivepipe::launch
