// Follows the messages of a running pipeline on the loopback interface.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "benchmarks/nodes/wire/message_times.h"
#include "common/pipeline/bus/bus.h"

namespace fivepipe::wire {

class BusTrace {
 public:
  // Follows the writers that discovery has found: those of topics with a frame number, except
  // NodeStatus. Throws std::system_error as LoopbackTrace does.
  explicit BusTrace(bus::Bus& bus);
  // Stops the trace. Returns the times by frame. Throws std::runtime_error if the kernel dropped
  // datagrams.
  std::map<std::uint64_t, FrameMessages> end();

 private:
  MessageTimes times_;
  LoopbackTrace trace_;  // its thread adds to times_
};

}  // namespace fivepipe::wire
