// Records the steps of a node for one frame with their times. Publishes them as FrameTrace, if that
// has a reader (a benchmark or a lossless replay), and as latencies in the status.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/bus/bus.h"
#include "common/pipeline/node/status.h"

namespace fivepipe::node {

// When the first and the last input of a frame arrived at the node [ns, CLOCK_REALTIME].
struct InputTimes {
  std::int64_t first_ns = 0, last_ns = 0;
};

// Steps of a frame, contiguous in time from the first begin().
class FrameSteps {
 public:
  void begin(std::string step);  // at most 32 characters; ends the previous step
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
  // `bus` and `status` must outlive the tracer.
  FrameTracer(bus::Bus& bus, NodeStatusReporter& status, std::string node);

  // Call once per frame, after the node has written all its messages. Ends the last step.
  void handled(std::uint64_t frame, std::int64_t capture_stamp_ns, const InputTimes& inputs,
               FrameSteps steps);

 private:
  NodeStatusReporter& status_;
  std::string node_;
  bus::Writer<bus::topics::FrameTrace> traces_;
};

}  // namespace fivepipe::node
