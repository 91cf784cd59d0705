#include "capture_node/video_pipe.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "capture_node/following_pipe.h"
#include "capture_node/pacing/frame_by_frame.h"
#include "capture_node/pacing/pacing.h"
#include "capture_node/publishing_pipe.h"
#include "capture_node/tile_assignment_pipe.h"
#include "common/base/realtime.h"
#include "common/config/deployment.h"
#include "common/pipeline/messages/view_messages.h"

namespace fivepipe::capture {
namespace {

using namespace std::chrono_literals;

// While frames in flight hold capture back, it wakes when the next frame is composited, or after
// this time to read the clock.
constexpr auto kPacingPollPeriod = 20ms;

// A reader holds 8 samples of a camera (bus.cpp).
constexpr int kMaxFramesHeld = 7;

// Time for the other nodes to start, on a busy machine.
constexpr auto kNodeStart = 60s;
constexpr auto kReadyPollPeriod = 100ms;
// Until the nodes have found each other, after this node has found all of them.
constexpr auto kDiscovery = 1s;
constexpr auto kDelivery = 5s;

bool has_renderer(const config::Deployment& deployment) {
  return std::ranges::any_of(deployment.nodes, config::draws_for_viewer);
}

bool captures(const config::Node& node) {
  return std::holds_alternative<config::CaptureConfig>(node.config);
}

// The wiring of the first capture node of a deployment, which decides when a frame is captured.
class VideoPipe {
 public:
  explicit VideoPipe(node::NodeContext& node)
      : node_(node),
        deployment_(node.deployment),
        config_(node::config_of<config::CaptureConfig>(node)),
        has_followers_(std::count_if(deployment_.nodes.begin(), deployment_.nodes.end(), captures) >
                       1),
        view_info_(node.bus.writer<bus::topics::ViewInfo>()),
        poses_(node.bus.writer<bus::topics::HeadPose>()),
        composited_(node.bus.reader<bus::topics::FrameComposited>()),
        tiles_(node),
        publisher_(node) {
    view_info_.write(messages::view_info_message(deployment_.viewer));
  }

  void run() {
    if (node_.every_frame)
      run_without_clock();
    else
      run_by_clock();
  }

 private:
  void run_by_clock() {
    Pacing pacing(deployment_.frame_rate_hz, config_.max_frames_in_flight, Pacing::Clock::now());
    while (node::running() && !publisher_.ended()) {
      take_composited(pacing);
      update_tiles();
      const auto now = Pacing::Clock::now();
      if (const auto lost = tiles_.take_lost()) pacing.give_up(*lost, now);
      // A render_node that joins gets no tiles of the frames before.
      const int renderers = composited_.writers();
      if (renderers > renderers_) pacing.give_up_all(now);
      renderers_ = renderers;
      if (const auto frame = pacing.next(now, renderers > 0)) {
        publish(*frame);
        node_.status.drop("pipeline_busy", pacing.take_skipped());
        continue;
      }
      const auto until_due = pacing.next_wakeup(now) - now;
      node_.bus.wait(until_due > 0ns ? std::min<Pacing::Clock::duration>(until_due, node::kMaxWait)
                                     : kPacingPollPeriod);
    }
  }

  // Every frame is processed: the other nodes treat the session as a lossless replay.
  void run_without_clock() {
    wait_for_nodes();
    auto sessions = node_.bus.writer<bus::topics::ReplaySession>();
    fivepipe_v1_ReplaySession session{};
    messages::set_text(session.replay, node_.node.name);
    session.lossless = true;
    sessions.write(session);
    sessions.wait_for_delivery(kDelivery);
    wait(kDiscovery);
    first_stamp_ns_ = base::now_realtime_ns();
    FrameByFrame frames(std::clamp(config_.max_frames_in_flight, 1, kMaxFramesHeld),
                        FrameByFrame::Clock::now());
    while (node::running() && !(publisher_.ended() && frames.is_done(FrameByFrame::Clock::now()))) {
      take_composited(frames);
      update_tiles();
      const auto frame =
          publisher_.ended() ? std::nullopt : frames.next(FrameByFrame::Clock::now());
      if (!frame)
        node_.bus.wait(kPacingPollPeriod);
      else if (!publish(*frame))
        frames.withdraw();
      report_lost(frames.take_lost());
    }
    report_lost(frames.take_lost());
  }

  void report_lost(std::uint64_t frames) { node_.status.drop("lost_frame", frames); }

  void wait(std::chrono::milliseconds time) {
    const auto until = FrameByFrame::Clock::now() + time;
    while (node::running() && FrameByFrame::Clock::now() < until) node_.bus.wait(kPacingPollPeriod);
  }

  // Waits until each other node reads its inputs, and the render_node can report its composites.
  void wait_for_nodes() {
    const auto until = FrameByFrame::Clock::now() + kNodeStart;
    for (std::set<std::string> missing = nodes_without_readers();
         node::running() && !missing.empty(); missing = nodes_without_readers()) {
      if (FrameByFrame::Clock::now() > until)
        throw node::NodeFailure(3, fmt::format("--every-frame: {} not ready within {} s",
                                               fmt::join(missing, ", "), kNodeStart.count()));
      wait(kReadyPollPeriod);
    }
  }

  std::set<std::string> nodes_without_readers() {
    std::set<std::pair<std::string, std::string>> reads, writes;  // node and topic
    for (const bus::EndpointDescription& endpoint : node_.bus.endpoints())
      (endpoint.writes ? writes : reads).emplace(endpoint.participant, endpoint.topic);
    std::set<std::string> missing;
    for (const config::Node& node : deployment_.nodes) {
      if (node.name == node_.node.name || config::spectator_of(node)) continue;
      const bool draws = std::holds_alternative<config::RenderConfig>(node.config);
      std::vector<const char*> inputs{draws            ? bus::topics::HullTile::name
                                      : captures(node) ? bus::topics::HeadPose::name
                                                       : bus::topics::ObjectPixelMap::name};
      if (deployment_.coverage && !draws && !captures(node))
        inputs.push_back(bus::topics::ObjectCoverage::name);
      for (const char* const input : inputs)
        if (!reads.contains({node.name, input})) missing.insert(node.name);
      if (draws && !writes.contains({node.name, bus::topics::FrameComposited::name}))
        missing.insert(node.name);
    }
    return missing;
  }

  // Pacer: Pacing or FrameByFrame.
  template <class Pacer>
  void take_composited(Pacer& pacing) {
    for (const auto& sample : composited_.take()) {
      if (!sample.valid() || deployment_.viewer.name != sample->viewer) continue;
      if (const auto why = messages::why_implausible(sample->frame, sample->composited_stamp_ns))
        node_.status.drop_from(composited_.process(sample),
                               {"bad_composited", sample->viewer, *why});
      else
        pacing.composited(sample->frame, Pacing::Clock::now());
    }
  }

  void update_tiles() {
    tiles_.update([&](std::uint64_t frame) { return publisher_.has_published_lately(frame); });
  }

  // Returns false without maps if the file of a camera has ended. Publishes the pose before the
  // maps, so that a reader that has all maps of a frame also has its pose.
  bool publish(std::int64_t frame) {
    const std::int64_t stamp_ns = stamp_of(frame);
    // The other capture nodes capture their cameras when they receive the pose. It then has the
    // time of the frame, because the images do not exist yet.
    if (has_followers_) publish_pose(frame, stamp_ns);
    auto set = publisher_.capture(frame, stamp_ns);
    if (!set) return false;
    if (!has_followers_) publish_pose(frame, set->stamp_ns);
    publisher_.publish(std::move(*set));
    return true;
  }

  // Returns the time of images without a clock; 0: the time at which they are read. Without a
  // clock, frames are one period apart however long they take, so that the simulation of a
  // recording is the same each time.
  std::int64_t stamp_of(std::int64_t frame) const {
    if (node_.every_frame)
      return first_stamp_ns_ +
             std::int64_t(std::llround(1e9 * double(frame) / deployment_.frame_rate_hz));
    return has_followers_ ? base::now_realtime_ns() : 0;
  }

  void publish_pose(std::int64_t frame, std::int64_t stamp_ns) {
    messages::FramePose pose{
        std::uint64_t(frame), stamp_ns,
        config::eye_from_world_at(deployment_.viewer, double(frame) / deployment_.frame_rate_hz),
        tiles_.owners_of(std::uint64_t(frame))};
    poses_.write(messages::head_pose_message(deployment_.viewer, std::move(pose)).message());
  }

  node::NodeContext& node_;
  const config::Deployment& deployment_;
  const config::CaptureConfig& config_;
  int renderers_ = 0;                // writers of FrameComposited
  bool has_followers_;               // other capture nodes
  std::int64_t first_stamp_ns_ = 0;  // of frame 0, with --every-frame
  bus::Writer<bus::topics::ViewInfo> view_info_;
  bus::Writer<bus::topics::HeadPose> poses_;
  bus::Reader<bus::topics::FrameComposited> composited_;
  TileAssignment tiles_;
  FramePublisher publisher_;
};

}  // namespace

void run_video_pipe(node::NodeContext& node) {
  if (node.every_frame && !has_renderer(node.deployment))
    throw node::NodeFailure(
        2, node.deployment.file.string() +
               ": --every-frame needs a render_node, whose composites pace the capture");
  if (node.every_frame)
    for (const auto& [camera, source] : node::config_of<config::CaptureConfig>(node).sources)
      if (config::has_clock(source))
        throw node::NodeFailure(2, node.deployment.file.string() +
                                       ": --every-frame needs files, but camera " + camera +
                                       " is a camera or a stream, which does not wait");
  try {
    if (config::first_capture_node(node.deployment)->name == node.node.name)
      VideoPipe(node).run();
    else
      run_following_pipe(node);
  } catch (const HardwareMissing& missing) {
    throw node::NodeFailure(3, missing.what());
  } catch (const SourceError& error) {
    throw node::NodeFailure(2, error.what());
  }
}

}  // namespace fivepipe::capture
