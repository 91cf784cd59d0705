#include "render_node/parent_pipe.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>

#include "common/base/realtime.h"
#include "common/config/views.h"
#include "common/pipeline/node/frame_trace.h"
#include "common/pipeline/node/replay_monitor.h"
#include "common/pipeline/node/status_names.h"
#include "render_node/frame_painter.h"
#include "render_node/messages.h"
#include "render_node/output/notice.h"
#include "render_node/output/presenter.h"
#include "render_node/overlays/messages_marks.h"
#include "render_node/simulation_age.h"
#include "render_node/spacing_pipe.h"
#include "render_node/views/pending_frames.h"
#include "render_node/views/view_assembler.h"
#include "render_node/virtual_frames.h"

namespace fivepipe::render {
namespace {

using namespace std::chrono_literals;
using Clock = PendingFrames::Clock;

// A replay has fewer frames in flight. If a peer sends this many without the light's view, or after
// a state without tiles, the node takes no further tiles before the timeout of the first one.
constexpr std::size_t kMaxPending = 64;
constexpr const char* kStandsStill = "No simulation: the virtual objects stand still";

// Returns the times of the first and of the last tile of all eyes.
node::InputTimes input_times(const EyeFrames& eyes) {
  node::InputTimes times{eyes.front().first_received_ns, eyes.front().last_received_ns};
  for (const HullFrame& eye : eyes) {
    times.first_ns = std::min(times.first_ns, eye.first_received_ns);
    times.last_ns = std::max(times.last_ns, eye.last_received_ns);
  }
  return times;
}

bool is_split_by_frames(const config::Deployment& deployment) {
  return std::any_of(deployment.nodes.begin(), deployment.nodes.end(),
                     [](const config::Node& node) {
                       const auto* const recon = std::get_if<config::ReconConfig>(&node.config);
                       return recon != nullptr && recon->split == config::ReconSplit::frames &&
                              recon->worker_count > 1;
                     });
}

bool has_simulation(const config::Deployment& deployment) {
  return std::any_of(deployment.nodes.begin(), deployment.nodes.end(), [](const auto& node) {
    return std::holds_alternative<config::SimConfig>(node.config);
  });
}

class ParentPipe {
 public:
  explicit ParentPipe(node::NodeContext& node)
      : node_(node),
        spectator_(config::spectator_of(node.node)),
        viewer_(spectator_ ? *spectator_ : node.deployment.viewer),
        presenter_(node::config_of<config::RenderConfig>(node), viewer_,
                   node.deployment.frame_rate_hz, node.out),
        painter_(node.deployment, viewer_),
        views_(config::hull_views(node.deployment.scene, viewer_)),
        is_split_by_frames_(is_split_by_frames(node.deployment)),
        has_simulation_(has_simulation(node.deployment)),
        simulation_age_(node.deployment.frame_rate_hz),
        tiles_(node.bus.reader<bus::topics::HullTile>()),
        states_(node.bus.reader<bus::topics::VirtualState>()),
        collisions_(node.bus.reader<bus::topics::CollisionResult>()),
        replay_(node.bus, node.status, [this] { reset(); }),
        traces_(node.bus, node.status, node.node.name),
        spacing_(node, presenter_) {
    if (!spectator_) composited_.emplace(node.bus.writer<bus::topics::FrameComposited>());
    if (!node.deployment.scene.particles.empty())
      particles_.emplace(node.bus.reader<bus::topics::Particles>());
    for (const config::SceneObject& object : node.deployment.scene.objects)
      if (object.reaction == config::Reaction::highlight) highlighted_.insert(object.name);
  }

  void run() {
    presenter_.wait_until_open();
    while (node::running()) {
      node_.bus.wait(pending_.empty() ? node::kMaxWait : 5ms);
      spacing_.step();
      // sim_node sends the collisions and particles of a frame before its state. Taking the states
      // first guarantees that those of every taken state are available.
      take_states();
      take_collisions();
      take_particles();
      if (needs_tiles()) take_tiles();
      while (node::running() && !pending_.empty() && is_ready()) composite();
    }
    if (unread_frame_ && presenter_.needs_still()) presenter_.present(*unread_frame_, image_bgr());
    presenter_.finish();
    report_drops();
  }

 private:
  void reset() {
    pending_.clear();
    composited_ns_.reset();
    views_.reset();
    virtual_frames_ = {};
    simulation_age_ = SimulationAge(node_.deployment.frame_rate_hz);
  }

  // In a lossless replay only the tiles of the light's view and those of an overtaken frame may
  // still be missing while a frame waits: further frames wait on the bus.
  bool needs_tiles() const {
    return !replay_.lossless() || pending_.empty() ||
           ((views_.lacks_light_of(pending_.first().front()) || overtaken() > 0) &&
            pending_.size() < kMaxPending);
  }

  // With `split: frames` the recon_nodes send whole frames independently, so that a frame may
  // overtake another one. In a lossless replay both are composited, in the order of their capture.
  FrameOrder order() const {
    return replay_.lossless() && is_split_by_frames_ ? FrameOrder::capture : FrameOrder::completion;
  }

  // Returns the number of frames that the first pending one has overtaken, as far as render_node
  // knows them from the simulation's states. sim_node sends the states in the order of the frames,
  // so those of all earlier frames have arrived when a frame's own has.
  std::size_t overtaken() const {
    if (order() == FrameOrder::completion) return 0;
    return virtual_frames_.between(composited_ns_, pending_.first().front().capture_stamp_ns);
  }

  // Requires a pending frame.
  bool is_ready() const {
    return has_all_inputs(pending_.first()) || pending_.is_due(Clock::now(), replay_.lossless());
  }

  bool has_all_inputs(const EyeFrames& eyes) const {
    const HullFrame& hull = eyes.front();
    return (virtual_frames_.has(hull.frame) || states_.writers() == 0) &&
           !views_.lacks_light_of(hull) && overtaken() == 0;
  }

  void take_collisions() {
    replay_.take(collisions_, [&](const auto& sample) {
      const bool is_highlighted = highlighted_.contains(sample->object);
      const OverlaidObject* const overlaid = painter_.overlaid(sample->object);
      if (!is_highlighted && !overlaid) return;
      const auto highlight = highlight_from(*sample);
      if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&highlight)) {
        node_.status.drop_from(collisions_.process(sample), *bad);
        return;
      }
      if (overlaid && !take_marks(sample, *overlaid)) return;
      const auto& [frame, stamp_ns, collides] = std::get<Highlight>(highlight);
      if (is_highlighted && collides)
        virtual_frames_.add_collision(frame, stamp_ns, sample->object);
    });
  }

  // Adds the marks of a message. Drops and counts an invalid message, and returns false.
  bool take_marks(const bus::Sample<bus::topics::CollisionResult>& sample,
                  const OverlaidObject& object) {
    auto marks = marks_from(*sample, object);
    if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&marks)) {
      node_.status.drop_from(collisions_.process(sample), *bad);
      return false;
    }
    virtual_frames_.add_marks(sample->frame, sample->capture_stamp_ns,
                              std::get<CollisionMarks>(std::move(marks)));
    return true;
  }

  void take_particles() {
    if (!particles_) return;
    replay_.take(*particles_, [&](const auto& sample) {
      auto received = particles_from(*sample, node_.deployment.scene);
      if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&received)) {
        node_.status.drop_from(particles_->process(sample), *bad);
        return;
      }
      auto& [frame, stamp_ns, cloud] = std::get<ReceivedParticles>(received);
      if (const auto why = painter_.renderer().why_undrawable(cloud))
        node_.status.drop_from(particles_->process(sample),
                               {"bad_particles", sample->source, *why});
      else
        virtual_frames_.add_particles(frame, stamp_ns, std::move(cloud));
    });
  }

  void take_states() {
    replay_.take(states_, [&](const auto& sample) {
      auto poses = poses_from(*sample, node_.deployment.scene);
      if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&poses))
        node_.status.drop_from(states_.process(sample), *bad);
      else
        virtual_frames_.add_state(sample->frame, sample->capture_stamp_ns,
                                  drawable(std::get<0>(std::move(poses)), sample));
    });
  }

  // Drops and counts the poses that the renderer cannot draw. Otherwise the kept states of a peer
  // could fill the memory.
  std::vector<ObjectPose> drawable(std::vector<ObjectPose> poses,
                                   const bus::Sample<bus::topics::VirtualState>& sample) {
    std::erase_if(poses, [&](const ObjectPose& pose) {
      const auto why = painter_.renderer().why_undrawable(pose);
      if (why) node_.status.drop_from(states_.process(sample), {"bad_state", pose.object, *why});
      return why.has_value();
    });
    return poses;
  }

  void take_tiles() {
    replay_.take(tiles_, [&](const auto& sample) {
      const std::optional<std::size_t> view = views_.find(sample->viewer);
      if (!view) {
        if (config::is_view_of(viewer_, sample->viewer))
          node_.status.drop_from(
              tiles_.process(sample),
              {"bad_tile", sample->viewer, "stereo differs from this node's deployment"});
        return;
      }
      auto tile = tile_from(*sample, node_.deployment.rig);
      if (const messages::BadMessage* bad = std::get_if<messages::BadMessage>(&tile)) {
        node_.status.drop_from(tiles_.process(sample), *bad);
        return;
      }
      std::get<ReceivedTile>(tile).received_ns = sample.arrived_ns();
      auto added = views_.add(*view, std::get<ReceivedTile>(tile), order());
      if (const RefusedTile* refused = std::get_if<RefusedTile>(&added))
        node_.status.drop_from(tiles_.process(sample), {"bad_tile", "", refused->reason});
      EyeFrames* const eyes = std::get_if<EyeFrames>(&added);
      if (!eyes) return;
      if (is_too_late(eyes->front())) return;
      pending_.add(std::move(*eyes), Clock::now(), order());
      while (node::running() && pending_.is_superseded(replay_.lossless())) composite();
    });
    report_drops();
  }

  // Returns true for a frame that arrives after the timeout of one that had overtaken it, which
  // counted it. If many follow each other, the stamp of the composited frame was wrong, for example
  // that of a peer, and the node goes on from here.
  bool is_too_late(const HullFrame& hull) {
    if (order() == FrameOrder::completion || !composited_ns_ ||
        hull.capture_stamp_ns > *composited_ns_) {
      late_in_a_row_ = 0;
      return false;
    }
    if (++late_in_a_row_ < TileAssembler::kMaxLateFrames) return true;
    composited_ns_.reset();
    return false;
  }

  void composite() {
    node_.status.drop("incomplete_hull", overtaken());
    const EyeFrames eyes = pending_.take();
    const HullFrame& hull = eyes.front();
    if (!virtual_frames_.has(hull.frame) && states_.writers() > 0) node_.status.drop("late_state");
    if (views_.lacks_light_of(hull)) node_.status.drop("late_light_view");
    static const VirtualFrame kNothing;
    const VirtualFrame* found = virtual_frames_.best_for(hull.frame);
    const VirtualFrame& virtual_frame = found ? *found : kNothing;
    stands_still_ =
        has_simulation_ &&
        simulation_age_.is_missing(hull.capture_stamp_ns,
                                   found ? std::optional(found->capture_stamp_ns) : std::nullopt);
    node_.status.diagnostic("simulation",
                            stands_still_ ? "sends no state; the virtual objects stand still" : "");
    if (simulation_age_.has_returned()) spdlog::info("simulation: sends states again");
    node::FrameSteps steps;
    steps.begin("render");
    painter_.draw(eyes, virtual_frame, views_.light_of(hull));
    const bool wanted = present(hull.frame);
    steps.end();
    const node::InputTimes times = input_times(eyes);
    const std::int64_t now_ns = base::now_realtime_ns();
    if (composited_) composited_->write(composited_message(viewer_.name, hull, now_ns));
    if (replay_.replaying())
      node_.status.latency(node::kArrivalToComposite, 1e-9 * double(now_ns - times.first_ns));
    else
      node_.status.latency_since_capture(
          spectator_ ? node::kCaptureToSpectator : node::kCaptureToComposite, hull.capture_stamp_ns,
          now_ns);
    composited_ns_ = hull.capture_stamp_ns;
    node_.status.count(spectator_ ? node::kSpectatorFrames : node::kFramesComposited);
    traces_.handled(hull.frame, hull.capture_stamp_ns, times, std::move(steps));
    node_.status.diagnostic(
        "hull", node::empty_hull_text(hull.empty_cameras, node_.deployment.hull_rule,
                                      config::shape_cameras(node_.deployment.rig).size()));
    if (!wanted) node::stop_running();
    pending_.begin_wait(Clock::now());
  }

  // Presents the last drawn frame. If no output needs it, waits for the GPU but does not read it
  // back. Returns false after the user has closed the window.
  bool present(std::uint64_t frame) {
    const WhenFull when_full = replay_.lossless() ? WhenFull::wait : WhenFull::drop;
    if (presenter_.wants(frame)) return presenter_.present(frame, image_bgr(), when_full);
    unread_frame_ = frame;
    painter_.renderer().finish();
    return true;
  }

  // Returns the last drawn frame.
  cv::Mat image_bgr() const {
    cv::Mat image_bgr = painter_.renderer().image_bgr();
    if (stands_still_)
      draw_notice(image_bgr, kStandsStill, int(config::eye_positions_m(viewer_).size()));
    return image_bgr;
  }

  void report_drops() {
    const ViewCounts counts = views_.counts();
    node_.status.drop("incomplete_hull", counts.incomplete - reported_.incomplete);
    node_.status.drop("late_tile", counts.late - reported_.late);
    node_.status.drop("repeated_tile", counts.duplicate - reported_.duplicate);
    node_.status.drop("missing_eye", counts.missing_eye - reported_.missing_eye);
    node_.status.drop("video_frame", presenter_.video_frames_dropped() - reported_video_drops_);
    reported_video_drops_ = presenter_.video_frames_dropped();
    reported_ = counts;
  }

  node::NodeContext& node_;
  const config::Viewer* const spectator_;  // nullptr: the node draws for the deployment's viewer
  const config::Viewer& viewer_;
  Presenter presenter_;   // first: its video opens while the painter compiles its shaders
  FramePainter painter_;  // before the readers: nodes that discover them begin to send
  ViewAssembler views_;
  ViewCounts reported_;
  std::uint64_t reported_video_drops_ = 0;
  VirtualFrames virtual_frames_;
  std::set<std::string> highlighted_;
  PendingFrames pending_;
  bool is_split_by_frames_, has_simulation_;
  SimulationAge simulation_age_;
  bool stands_still_ = false;                  // the virtual objects in the last drawn frame
  std::optional<std::int64_t> composited_ns_;  // capture stamp of the last composited frame
  std::uint32_t late_in_a_row_ = 0;            // see is_too_late()
  std::optional<std::uint64_t> unread_frame_;  // the last frame that was not read back
  bus::Reader<bus::topics::HullTile> tiles_;
  bus::Reader<bus::topics::VirtualState> states_;
  bus::Reader<bus::topics::CollisionResult> collisions_;
  // Present if the scene has particles.
  std::optional<bus::Reader<bus::topics::Particles>> particles_;
  node::ReplayMonitor replay_;
  node::FrameTracer traces_;
  SpacingPipe spacing_;
  // Absent for a spectator: no node waits for its composites.
  std::optional<bus::Writer<bus::topics::FrameComposited>> composited_;
};

}  // namespace

void run_parent_pipe(node::NodeContext& node) { ParentPipe(node).run(); }

}  // namespace fivepipe::render
