// Sends a recording's messages again: verbatim, by as many writers as there were, with their source time stamps.
#pragma once
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bus/serialized.h"
#include "common/recording/frame_groups.h"
#include "common/recording/recording.h"
#include "launch/recording/frame_times.h"

namespace fivepipe {

// Somebody whose inputs are replayed.
struct ReplayedNode {
  std::string name, program;
};

// How a frame's messages are sent to nodes that are waited for.
enum class SendOrder {
  needed_first,  // what a frame needs has arrived before what sets off work on it: the same output on every run
  needed_ahead,  // and, as fast as it goes, is sent while the nodes still work on the frame before
  as_captured,   // one after the other without waiting, as capture_node does
};

struct ReplayPlan {
  std::set<mcap::Id> channels;       // of the recording
  std::int64_t start_ns = 0, end_ns = 0;  // log stamps, both included; what is latched before the start is sent first
  double rate = 1;                   // 1: as recorded; 0: as fast as it goes
  // Writers block until their readers have everything, and each frame's messages go out together, in the order in which they are needed.
  bool lossless = false;
  // Lossless: at most so many frames are with these nodes at a time. A frame has left a node when its FrameTrace says so.
  std::vector<ReplayedNode> nodes;
  int frames_in_flight = 2;
  SendOrder order = SendOrder::needed_first;
  std::size_t shape_cameras = 0;     // maps that make a frame set, of nodes that wait for sets
  std::chrono::milliseconds longest_wait{5000};  // for a reader, or for a node to handle a frame; then it ends: it is lossless no more
};

// Sets the plan's start and end, given in seconds after the recording's start. Throws UsageError where nothing is recorded between them.
void set_range(ReplayPlan& plan, const recording::Recording& recording, double start_s, std::optional<double> end_s);

struct ReplayCounts {
  std::map<std::string, std::uint64_t> in_file, sent;  // by topic
  std::uint64_t frames = 0;                              // sent
  std::map<std::string, std::uint64_t> expected, handled;  // by node: frames complete for it, and those that it has handled
  std::uint64_t late = 0;                                // messages that stand too far from their frame in the file
  std::uint64_t damaged = 0;                             // chunks of the file that could not be read
  double seconds = 0;                                    // from the first message to the last one handled
  // Everything in the file arrived, and was handled: at least one frame.
  bool complete() const { return in_file == sent && expected == handled && late == 0 && damaged == 0 && (expected.empty() || frames > 0); }
};

// What the caller wants next.
enum class ReplayControl { go_on, pause, one_frame, stop };

class Replayer {
 public:
  using Clock = std::chrono::steady_clock;

  // Makes the writers. Throws recording::RecordingError where types differ from this build's.
  Replayer(Bus& bus, const recording::Recording& recording, const ReplayPlan& plan);

  // For people: who else writes what this replay would; empty: nobody that is known yet.
  std::vector<std::string> conflicts() const;
  // For people: which reader is not there yet; empty: all that are expected. Without nodes: somebody that reads any of it.
  std::string missing_reader() const;

  // Announces the session, sends everything that is due, waits for the nodes. `control` is asked at least ten times a second. May be
  // called again, from the start.
  void run(const std::function<ReplayControl()>& control);
  const ReplayCounts& counts() const { return counts_; }

  // For benchmarks.
  std::function<void(std::uint64_t frame, const SendTimes&)> on_frame_sent;
  std::function<void(const fivepipe_v1_FrameTrace&)> on_trace;

 private:
  struct NodeProgress {
    std::set<std::uint64_t> waited_for;  // sent, complete, and not handled yet
    Clock::time_point heard{};
  };
  bool may_go_on(const std::function<ReplayControl()>& control);
  void announce();
  void send_latched_before_start();
  void send_frames(const std::function<ReplayControl()>& control);
  void send_as_they_stand(const std::function<ReplayControl()>& control);
  void send_needed(const recording::FrameGroup& group);
  void send_what_sets_off_work(const recording::FrameGroup& group);
  void write(const recording::RecordedChannel& channel, std::optional<recording::KeyChange> change, std::int64_t source_stamp_ns, std::span<const std::byte> cdr);
  bool wait_until(std::int64_t log_stamp_ns, bool is_step, const std::function<ReplayControl()>& control);
  bool is_paused() const { return last_control_ == ReplayControl::pause || last_control_ == ReplayControl::one_frame; }
  void pace_incomplete(const recording::FrameGroup& group);
  void wait_for_those_under_way();
  void expect(const recording::FrameGroup& group);
  bool replays(const std::string& topic) const;
  bool is_complete_for(const ReplayedNode& node, const recording::FrameGroup& group) const;
  void take_traces();
  bool wait_for_nodes(std::size_t at_most_open, const std::function<ReplayControl()>& control);
  recording::Recording::Cursor cursor() const;

  Bus& bus_;
  const recording::Recording& recording_;
  ReplayPlan plan_;
  Writer<topics::ReplaySession> session_;
  Reader<topics::FrameTrace> traces_;
  std::map<std::string, std::unique_ptr<SerializedWriter>> writers_;  // by topic and recorded writer
  std::map<mcap::Id, SerializedWriter*> writer_of_;
  std::map<std::string, NodeProgress> progress_;
  std::set<SerializedWriter*> not_acknowledged_;  // of what the next frame needs
  std::int64_t send_start_ns_ = 0;                 // of that frame
  ReplayCounts counts_;
  Clock::time_point counts_started_{}, wall_zero_{};
  std::int64_t log_zero_ns_ = 0;
  bool stopped_ = false, hung_ = false, was_step_ = false;
  int steps_owed_ = 0, incomplete_in_a_row_ = 0;
  ReplayControl last_control_ = ReplayControl::go_on;
};

}  // namespace fivepipe
