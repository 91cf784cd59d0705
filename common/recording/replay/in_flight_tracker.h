// Tracks which frames each node of a lossless replay has received but not yet handled, according to
// its FrameTraces.
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
  // `replayed` lists the replayed topics. The bus and the recording must outlive this object. Reads
  // FrameTraces only if the plan is lossless and names nodes, because nodes publish them only while
  // a reader exists.
  InFlightTracker(bus::Bus& bus, const recording::Recording& recording, const ReplayPlan& plan,
                  std::set<std::string> replayed);

  void reset();  // discards all traces and counts
  // Call before sending the frame. Counts it for the nodes for which it is complete, which will
  // handle it.
  void expect(const recording::FrameGroup& group);
  void take_traces();

  bool is_waited_for(std::uint64_t frame) const;  // by at least one node
  std::size_t max_open_frames() const;            // maximum over all nodes
  // Describes a node with more than `max_in_flight` open frames and no FrameTrace for the plan's
  // timeout. Empty if there is none.
  std::string stalled(std::size_t max_in_flight) const;

  // Frames by node: those that are complete for it, and those that it has handled.
  const std::map<std::string, std::uint64_t>& expected() const { return expected_; }
  const std::map<std::string, std::uint64_t>& handled() const { return handled_; }

  std::function<void(const fivepipe_v1_FrameTrace&)> on_trace;

 private:
  using Clock = std::chrono::steady_clock;
  struct Progress {
    std::set<std::uint64_t> open;  // sent and complete, but not handled yet
    Clock::time_point last_trace{};
  };
  // Counts and logs a trace with impossible numbers, at most one line per kProgressPeriod.
  void refuse(const bus::Sample<bus::topics::FrameTrace>& trace);
  struct Tiles {
    std::uint64_t present = 0, all = 0;
  };
  using TilesByView = std::map<std::string, Tiles>;
  // Returns true if the group has every tile of each of these views.
  bool has_all_tiles(const recording::FrameGroup& group, const std::set<std::string>& names);
  void warn_of_other_views(const TilesByView& views, const std::set<std::string>& names);
  bool is_complete_for(const ReplayedNode& node, const recording::FrameGroup& group);

  const recording::Recording& recording_;
  const ReplayPlan plan_;
  const std::set<std::string> replayed_;
  std::optional<bus::Reader<bus::topics::FrameTrace>> traces_;
  std::map<std::string, Progress> progress_;
  std::map<std::string, std::uint64_t> expected_, handled_;
  bool is_warned_of_views_ = false;
  std::uint64_t refused_ = 0;
  std::optional<Clock::time_point> refusal_logged_;
};

}  // namespace fivepipe::replay
