// What a node did with one frame and when: told to whoever reads FrameTrace (benchmarks, lossless
// replays), and as latencies in the status.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/bus/bus.h"
#include "common/pipeline/node/status.h"

namespace fivepipe::node {

// When this node took the first and the last of a frame's inputs [ns, CLOCK_REALTIME].
struct InputTimes {
  std::int64_t first_ns = 0, last_ns = 0;
};

// The steps follow one another without gaps, from the first begin() on.
class FrameSteps {
 public:
  void begin(std::string step);  // at most 31 characters; ends the step before
  void end();

  struct Step {
    std::string name;
    std::int64_t start_ns, end_ns;  // CLOCK_REALTIME
  };
  const std::vector<Step>& steps() const { return steps_; }

 private:
  std::vector<Step> steps_;
  bool open_ = false;
};

class FrameTracer {
 public:
  FrameTracer(bus::Bus& bus, NodeStatusReporter& status, std::string node);

  // Once a frame, after all that was made of it has been written. Ends its last step.
  void handled(std::uint64_t frame, std::int64_t capture_stamp_ns, const InputTimes& inputs,
               FrameSteps steps);

 private:
  NodeStatusReporter& status_;
  std::string node_;
  bus::Writer<bus::topics::FrameTrace> traces_;
};

}  // namespace fivepipe::node
