#include "capture_node/following_pipe.h"

#include <deque>
#include <utility>
#include <variant>

#include "capture_node/pacing/pacing.h"
#include "capture_node/publishing_pipe.h"
#include "common/config/deployment.h"
#include "common/pipeline/frames/camera_writers.h"
#include "common/pipeline/messages/view_messages.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::capture {
namespace {

class FollowingPipe {
 public:
  explicit FollowingPipe(node::NodeContext& node)
      : node_(node),
        publisher_(node),
        composited_(node.bus.reader<bus::topics::FrameComposited>()),
        poses_(node.bus.reader<bus::topics::HeadPose>()) {}

  void run() {
    last_pose_ = Pacing::Clock::now();  // learning the background may have taken long
    while (node::running() && !publisher_.ended()) {
      take_poses();
      take_composited();
      report_silence();
      if (due_.empty()) {
        node_.bus.wait(node::kMaxWait);
        continue;
      }
      // The first node does not wait for this one: with a clock, only its newest frame can still be
      // captured at its time.
      if (!node_.every_frame) skip_all_but_newest();
      const Due due = due_.front();
      due_.pop_front();
      if (auto set = publisher_.capture(due.frame, due.stamp_ns)) {
        last_ = set->frame;
        publisher_.publish(std::move(*set));
      }
    }
    if (node_.every_frame) wait_until_composited();
  }

 private:
  struct Due {
    std::int64_t frame, stamp_ns;
  };
  // A reader of poses holds 8 of them (bus.cpp), and so many frames can be in flight.
  static constexpr std::size_t kMaxDue = 8;

  void take_poses() {
    constexpr std::size_t kHead = 0;  // the only source of poses
    for (const auto& sample : poses_.take()) {
      if (!sample.valid() || node_.deployment.viewer.name != sample->viewer) continue;
      const auto pose = messages::head_pose_from(*sample);
      if (const auto* bad = std::get_if<messages::BadMessage>(&pose)) {
        node_.status.drop_from(poses_.process(sample), *bad);
        continue;
      }
      if (!writers_.judge(kHead, sample.writer()).is_current) {
        node_.status.drop({"other_writer", sample->viewer, ""});
        continue;
      }
      last_pose_ = Pacing::Clock::now();
      const auto& of_frame = std::get<messages::FramePose>(pose);
      due_.push_back({std::int64_t(of_frame.frame), of_frame.capture_stamp_ns});
      if (due_.size() > kMaxDue) skip_first();
    }
  }
  // Without poses this node captures nothing.
  void report_silence() {
    const auto silence = Pacing::Clock::now() - last_pose_;
    node_.status.diagnostic(
        "poses", silence < kSilence
                     ? ""
                     : "no HeadPose for 5 s from " +
                           config::first_capture_node(node_.deployment)->name +
                           ", the first capture_node, which decides when frames are captured");
  }

  void skip_all_but_newest() {
    while (due_.size() > 1) skip_first();
  }
  void skip_first() {
    due_.pop_front();
    node_.status.drop("pipeline_busy");
  }

  // Also while nothing waits for them: the bus wakes the node as long as samples are not taken.
  void take_composited() {
    for (const auto& sample : composited_.take()) {
      if (!sample.valid() || node_.deployment.viewer.name != sample->viewer) continue;
      if (const auto why = messages::why_implausible(sample->frame, sample->composited_stamp_ns))
        node_.status.drop_from(composited_.process(sample),
                               {"bad_composited", sample->viewer, *why});
      else
        last_composited_ = sample->frame;
    }
  }
  // This node's end ends the deployment, so it waits for the frames in flight.
  void wait_until_composited() {
    const auto until = Pacing::Clock::now() + kFinish;
    while (node::running() && last_ && (!last_composited_ || *last_composited_ < *last_) &&
           Pacing::Clock::now() < until) {
      node_.bus.wait(node::kMaxWait);
      take_composited();
    }
  }
  static constexpr std::chrono::seconds kFinish{20}, kSilence{5};

  node::NodeContext& node_;
  frames::CameraWriters writers_;
  std::deque<Due> due_;
  Pacing::Clock::time_point last_pose_;
  std::optional<std::uint64_t> last_;             // published
  std::optional<std::uint64_t> last_composited_;  // by a render_node
  FramePublisher publisher_;
  bus::Reader<bus::topics::FrameComposited> composited_;
  // After the sources are open: the first node waits for this reader.
  bus::Reader<bus::topics::HeadPose> poses_;
};

}  // namespace

void run_following_pipe(node::NodeContext& node) { FollowingPipe(node).run(); }

}  // namespace fivepipe::capture
