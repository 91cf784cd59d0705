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

  pid_t pid() const { return child_.pid(); }
  void forward_output();
  std::optional<ProcessExit> ended() { return child_.ended(); }
  // Sends SIGTERM and waits for the end: at most 2 s, not at all after two signals (interrupt.h).
  // Then kills the recorder. Returns nullopt if even that does not end it within kKillTimeout.
  // Forwards its last output to stderr.
  std::optional<ProcessExit> finish();

 private:
  ChildProcess child_;
};

// The name of this process's recorder on the bus. It is unique, because the domain may have another
// recorder.
std::string own_recorder_name();

}  // namespace fivepipe::launch
