// The nodes that a lossless replay feeds: which frames they have and have not handled yet, as their
// FrameTraces tell.
#pragma once
#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "common/pipeline/bus/bus.h"
#include "common/recording/files/frame_groups.h"
#include "common/recording/replay/replay_plan.h"

namespace fivepipe::replay {

class InFlightTracker {
 public:
  // replayed: the topics that are. Borrows the recording. Without nodes in the plan, or where it is
  // not lossless, traces are not read: nodes make them for readers only.
  InFlightTracker(bus::Bus& bus, const recording::Recording& recording, const ReplayPlan& plan,
                  std::set<std::string> replayed);

  void reset();  // what was told and counted before is forgotten
  // The frame is about to be sent: nodes for which it is complete will handle it.
  void expect(const recording::FrameGroup& group);
  void take_traces();

  bool is_waited_for(std::uint64_t frame) const;  // by one node at least
  std::size_t max_open_frames() const;            // frames that the node with most has
  // For people: which node with more than so many frames has told nothing for the plan's longest
  // wait, and where it is; empty: none.
  std::string stalled(std::size_t max_in_flight) const;

  // By node: frames complete for it, and those that it has handled.
  const std::map<std::string, std::uint64_t>& expected() const { return expected_; }
  const std::map<std::string, std::uint64_t>& handled() const { return handled_; }

  std::function<void(const fivepipe_v1_FrameTrace&)> on_trace;

 private:
  using Clock = std::chrono::steady_clock;
  struct Progress {
    std::set<std::uint64_t> open;  // sent, complete, and not handled yet
    Clock::time_point last_trace{};
  };
  bool is_complete_for(const ReplayedNode& node, const recording::FrameGroup& group) const;

  const recording::Recording& recording_;
  const ReplayPlan plan_;
  const std::set<std::string> replayed_;
  std::optional<bus::Reader<bus::topics::FrameTrace>> traces_;
  std::map<std::string, Progress> progress_;
  std::map<std::string, std::uint64_t> expected_, handled_;
};

}  // namespace fivepipe::replay
