// Times of a replayed frame, all CLOCK_REALTIME.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fivepipe::replay {

// When the replayer sent a frame: its first message, the first that triggers work, and the last.
struct SendTimes {
  std::int64_t start_ns = 0, release_ns = 0, end_ns = 0;
};

struct StepTimes {
  std::string step;
  std::int64_t start_ns = 0, end_ns = 0;
};
struct FrameAtNode {
  std::int64_t first_input_ns = 0, last_input_ns = 0;
  std::vector<StepTimes> steps;
};
struct FrameTimes {
  std::uint64_t frame = 0;
  SendTimes sent;                          // its recorded inputs
  std::int64_t composited_ns = 0;          // from FrameComposited; 0: no rendering node is measured
  std::int64_t composite_received_ns = 0;  // when FrameComposited arrived
  std::map<std::string, FrameAtNode> nodes;
};

}  // namespace fivepipe::replay
