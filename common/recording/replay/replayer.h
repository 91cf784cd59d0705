// Replays a recording: sends its messages unchanged, with their source timestamps, from as many
// writers as were recorded.
#pragma once
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/pipeline/bus/serialized.h"
#include "common/recording/files/frame_groups.h"
#include "common/recording/files/recording.h"
#include "common/recording/replay/frame_times.h"
#include "common/recording/replay/in_flight_tracker.h"
#include "common/recording/replay/replay_plan.h"

namespace fivepipe::replay {

struct ReplayCounts {
  std::map<std::string, std::uint64_t> in_file, sent;  // by topic
  std::uint64_t frames = 0;                            // sent
  // By node: frames that are complete for it, and frames that it has handled.
  std::map<std::string, std::uint64_t> expected, handled;
  std::uint64_t late = 0;     // messages too far behind their frame in the file
  std::uint64_t damaged = 0;  // chunks that could not be read
  double seconds = 0;         // from sending the first message to handling the last one
  // Everything in the file was sent and handled, including at least one frame if nodes are named.
  bool complete() const {
    return in_file == sent && expected == handled && late == 0 && damaged == 0 &&
           (expected.empty() || frames > 0);
  }
};

// The caller's request.
enum class ReplayControl { resume, pause, step, stop };

class Replayer {
 public:
  using Clock = std::chrono::steady_clock;

  // Creates the writers. The bus and the recording must outlive this object. Throws
  // recording::RecordingError if types differ from this build's.
  Replayer(bus::Bus& bus, const recording::Recording& recording, const ReplayPlan& plan);

  // Returns one text for each other writer of a replayed topic that discovery has found, except
  // writers of NodeStatus and FrameTrace.
  std::vector<std::string> conflicts() const;
  // Describes an expected reader that has not been discovered; empty if all have. If the plan names
  // no nodes, expects at least one reader of any topic.
  std::string missing_reader() const;

  // Announces the session, sends all messages and waits for the nodes. Calls `control` at least ten
  // times per second. Further calls start again from the beginning.
  void run(const std::function<ReplayControl()>& control);
  const ReplayCounts& counts() const { return counts_; }

  // Listeners for benchmarks. run() calls them in its thread.
  std::function<void(std::uint64_t frame, const SendTimes&)> on_frame_sent;
  void set_trace_listener(std::function<void(const fivepipe_v1_FrameTrace&)> listener) {
    nodes_.on_trace = std::move(listener);
  }

 private:
  bool may_continue(const std::function<ReplayControl()>& control);
  void announce();
  void send_latched_before_start();
  void send_frames(const std::function<ReplayControl()>& control);
  void send_in_file_order(const std::function<ReplayControl()>& control);
  void send_needed(const recording::FrameGroup& group);
  void send_triggers(const recording::FrameGroup& group);
  void write(const recording::RecordedChannel& channel, std::optional<recording::KeyChange> change,
             std::int64_t source_stamp_ns, std::span<const std::byte> cdr);
  bool wait_until(std::int64_t log_stamp_ns, bool is_step,
                  const std::function<ReplayControl()>& control);
  bool is_paused() const {
    return last_control_ == ReplayControl::pause || last_control_ == ReplayControl::step;
  }
  void pace_incomplete(const recording::FrameGroup& group);
  void wait_for_in_flight();
  bool wait_for_nodes(std::size_t max_in_flight, const std::function<ReplayControl()>& control);
  recording::Recording::Cursor cursor() const;

  bus::Bus& bus_;
  const recording::Recording& recording_;
  ReplayPlan plan_;
  bus::Writer<bus::topics::ReplaySession> session_;
  // By topic and recorded writer.
  std::map<std::string, std::unique_ptr<bus::SerializedWriter>> writers_;
  std::map<mcap::Id, bus::SerializedWriter*> writer_of_;
  InFlightTracker nodes_;
  // Writers of messages that the next frame needs and that are not yet acknowledged.
  std::set<bus::SerializedWriter*> not_acknowledged_;
  std::int64_t send_start_ns_ = 0;  // of the next frame
  ReplayCounts counts_;
  Clock::time_point counts_started_{}, wall_zero_{};
  std::int64_t log_zero_ns_ = 0;
  bool stopped_ = false, stalled_ = false, was_step_ = false;
  int pending_steps_ = 0, consecutive_incomplete_ = 0;
  ReplayControl last_control_ = ReplayControl::resume;
};

}  // namespace fivepipe::replay
