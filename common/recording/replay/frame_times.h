// When what happened to a replayed frame. All times CLOCK_REALTIME [ns].
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fivepipe::replay {

// Of its sending: its first message, the first of those that set off work, and the last.
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
  SendTimes sent;                  // its recorded inputs
  std::int64_t composited_ns = 0;  // as FrameComposited tells; 0: no rendering node is measured
  std::int64_t composite_received_ns = 0;  // when that message was here
  std::map<std::string, FrameAtNode> nodes;
};

}  // namespace fivepipe::replay
