// What a NodeStatus reports, and the message of it. Internal to status.h.
#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/pipeline/bus/topics.h"
#include "common/pipeline/node/drop_counts.h"
#include "common/pipeline/node/status.h"
#include "common/pipeline/node/status_names.h"

namespace fivepipe::node {

// The newest values of a latency.
struct LatencyWindow {
  static constexpr std::size_t kMax = 1 << 13;  // four and a half minutes at 30 Hz
  std::vector<float> newest_ms;
  std::uint64_t count = 0;
  void add(double ms);
};

struct CollisionTotals {
  std::uint64_t frames = 0, points = 0, first_contacts = 0;
};
struct TopicTotals {
  std::uint64_t sent = 0, not_sent = 0;
  RecordedCounts recorded;
};

struct NodeState {
  // At most this many senders of refused messages are named.
  static constexpr std::size_t kMaxSenders = 16;

  std::uint64_t newest_frame = 0;
  bool has_handled_frame = false;
  double cpu_at_first_frame_s = 0;  // of the process; valid if has_handled_frame
  std::deque<std::chrono::steady_clock::time_point> frame_times;
  std::string gl_renderer;
  std::map<std::string, std::uint64_t> counts, empty_cameras;
  DropCounts drops;
  NamedCounts refused{kMaxSenders, std::string(kRefusedFrom) + "other processes"};
  std::map<std::string, TopicTotals> topics;
  std::map<std::string, CollisionTotals> collisions;
  std::map<std::string, LatencyWindow> latencies;
  std::map<std::string, std::string> diagnostics;  // by subject
};

// The sequences of a NodeStatus with their storage. Truncates texts that exceed their field.
class StatusLists {
 public:
  explicit StatusLists(const NodeState& state);
  // Points the message to the sequences; they must outlive it.
  void lend_to(fivepipe_v1_NodeStatus& message);

 private:
  std::vector<fivepipe_v1_NamedCount> counts_;
  std::vector<fivepipe_v1_DropCount> drops_;
  std::vector<fivepipe_v1_TopicCounts> topics_;
  std::vector<fivepipe_v1_EmptyCameraCount> empty_cameras_;
  std::vector<fivepipe_v1_ObjectCollisionCounts> collisions_;
  std::vector<fivepipe_v1_LatencySummary> latencies_;
  std::vector<fivepipe_v1_Diagnostic> diagnostics_;
};

}  // namespace fivepipe::node
