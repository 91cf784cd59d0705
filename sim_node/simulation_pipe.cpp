#include "sim_node/simulation_pipe.h"

#include <functional>
#include <memory>
#include <optional>

#include "common/base/realtime.h"
#include "common/pipeline/node/frame_set_reader.h"
#include "common/pipeline/node/frame_trace.h"
#include "common/pipeline/node/replay_monitor.h"
#include "sim_node/messages.h"
#include "sim_node/messages_collision.h"
#include "sim_node/objects/joint_clearance.h"
#include "sim_node/spacing_pipe.h"

namespace fivepipe::sim {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// If no frame set arrives for this long, the simulation advances by the clock against the last
// hull.
constexpr auto kFrameSetTimeout = 100ms;
// Maximum age of a hull to simulate against. If it is older, the simulation stops until a frame set
// arrives.
constexpr auto kMaxHullAge = 1s;

// Time for the frame in progress after a signal to end. The process must end within 2 s.
constexpr auto kFinishFrame = 500ms;

// Returns a function that returns true from this time after a signal to end. It is called often.
std::function<bool()> stop_after(Clock::duration time) {
  return [time, first_seen = std::optional<Clock::time_point>()]() mutable {
    if (node::running()) return false;
    if (!first_seen) first_seen = Clock::now();
    return Clock::now() - *first_seen > time;
  };
}

void count(node::NodeStatusReporter& status, const CollisionReport& report) {
  if (report.details.first_contact) status.first_contact(report.name);
  if (report.collision.colliding()) status.collided(report.name, report.collision.points.size());
}

// Counts the simulation's irregular events since the last call.
void count_new(node::NodeStatusReporter& status, const SimulationCounters& now,
               SimulationCounters& reported) {
  const auto count_increase = [&](const char* name, std::uint64_t count, std::uint64_t before) {
    if (count > before) status.count(name, count - before);
  };
  count_increase("contacts", now.contacts, reported.contacts);
  count_increase("contacts_unrecovered", now.unrecovered, reported.unrecovered);
  count_increase("contacts_still_colliding", now.still_colliding, reported.still_colliding);
  count_increase("contact_impacts", now.impacts, reported.impacts);
  count_increase("objects_respawned", now.respawned, reported.respawned);
  count_increase("cloth_contacts", now.cloth.contacts, reported.cloth.contacts);
  count_increase("cloth_unrecovered", now.cloth.unrecovered, reported.cloth.unrecovered);
  count_increase("cloth_still_colliding", now.cloth.still_colliding,
                 reported.cloth.still_colliding);
  count_increase("cloth_self_contacts", now.cloth.self_contacts, reported.cloth.self_contacts);
  count_increase("cloth_object_contacts", now.cloth.object_contacts,
                 reported.cloth.object_contacts);
  count_increase("cloths_reset", now.cloth.reset, reported.cloth.reset);
  count_increase("particle_contacts", now.particles.contacts, reported.particles.contacts);
  count_increase("particles_stuck", now.particles.stuck, reported.particles.stuck);
  count_increase("particles_not_finite", now.particles.not_finite, reported.particles.not_finite);
  count_increase("backward_stamps", now.backward_stamps, reported.backward_stamps);
  count_increase("milliseconds_skipped", std::uint64_t(1e3 * now.skipped_s),
                 std::uint64_t(1e3 * reported.skipped_s));
  count_increase("objects_undecided", now.detection.undecided, reported.detection.undecided);
  count_increase("points_unconfirmed", now.detection.points_unconfirmed,
                 reported.detection.points_unconfirmed);
  reported = now;
}

class SimulationPipe {
 public:
  explicit SimulationPipe(node::NodeContext& node)
      : node_(node),
        scene_(node.deployment.scene),
        simulation_(new_simulation()),
        replay_(node.bus, node.status, [this] { reset(); }),
        sets_(node.bus, node.deployment.rig, node.status, node::frame_set_options(node.deployment)),
        commands_(node.bus.reader<bus::topics::Command>()),
        spacing_(node),
        traces_(node.bus, node.status, node.node.name),
        states_(node.bus.writer<bus::topics::VirtualState>()),
        collisions_(node.bus.writer<bus::topics::CollisionResult>()) {
    if (!scene_.particles.empty()) particles_.emplace(node.bus.writer<bus::topics::Particles>());
    if (scene_.history) components_.emplace(node.bus.writer<bus::topics::HullComponents>());
    if (config::moves_objects(scene_))
      metrics_.emplace(node.bus.writer<bus::topics::SimulationMetrics>());
  }

  void run() {
    while (node::running()) {
      node_.bus.wait(std::min<Clock::duration>(kFrameSetTimeout, node::kMaxWait));
      const bool was_lossless = replay_.lossless();
      replay_.take(commands_,
                   [this](const auto& command) { apply(*command, node_.node.name, *simulation_); });
      // The spacing of a frame arrives before its maps.
      waiting_ = sets_.take(replay_);
      is_replayed_ = replay_.replaying();
      spacing_.take(replay_);
      for (frames::FrameSet& set : waiting_) simulate(std::move(set));
      // The results of a lossless replay depend on its frames alone, so after the replay the
      // simulation does not advance against the last hull.
      if (was_lossless && !replay_.lossless()) held_.reset();
      if (!replay_.lossless()) advance_by_wall_clock();
    }
  }

 private:
  std::unique_ptr<Simulation> new_simulation() const {
    return std::make_unique<Simulation>(scene_, node::config_of<config::SimConfig>(node_),
                                        node_.deployment.rig.volume_m, stop_after(kFinishFrame));
  }

  // Restores the state after the start of the process, so that a replay gives the same bits again.
  void reset() {
    sets_.reset();
    waiting_.clear();
    spacing_.reset();
    simulation_ = new_simulation();
    reported_ = {};
    held_.reset();
    first_stamp_ns_.reset();
  }

  void simulate(frames::FrameSet set) {
    // Time is relative to the first timestamp, because seconds since 1970 leave a double too few
    // digits.
    if (!first_stamp_ns_) first_stamp_ns_ = set.capture_stamp_ns;
    held_ = std::move(set);
    last_set_time_ = Clock::now();
    node::FrameSteps steps;
    steps.begin("simulate");
    spacing_.apply(held_->capture_stamp_ns, *simulation_);
    if (!simulation_->advance_to(stamp_s(), held_->silhouettes, held_->outlines)) return;
    steps.begin("write_state");
    count_new(node_.status, simulation_->counters(), reported_);
    for (const CollisionReport& report : simulation_->collisions()) count(node_.status, report);
    publish();
    if (components_)
      components_->write(
          components_message(node_.node.name, result_frame(), *simulation_->hull_components())
              .message());
    spacing_.publish(held_->frame, held_->capture_stamp_ns, is_replayed_);
    publish_metrics();
    traces_.handled(held_->frame, held_->capture_stamp_ns,
                    {held_->first_received_ns, held_->last_received_ns}, std::move(steps));
  }

  void advance_by_wall_clock() {
    if (!held_) return;
    const auto waited = Clock::now() - last_set_time_;
    if (waited < kFrameSetTimeout || waited > kMaxHullAge) return;
    {
      const node::StageTimer timer(node_.status, "simulate_held_hull");
      if (!simulation_->advance_to(stamp_s() + std::chrono::duration<double>(waited).count()))
        return;
    }
    count_new(node_.status, simulation_->counters(), reported_);
    publish();
    publish_metrics();
  }

  double stamp_s() const { return base::difference_s(held_->capture_stamp_ns, *first_stamp_ns_); }
  ResultFrame result_frame() const {
    return {held_->frame, held_->capture_stamp_ns, stamp_s(), held_->cameras};
  }

  // Writes the state last, so that a node that receives it has the frame's collisions and
  // particles.
  void publish() {
    for (const CollisionReport& report : simulation_->collisions())
      collisions_.write(
          collision_message(result_frame(), report, scene_.objects[report.object].requests)
              .message());
    for (std::size_t i = 0; i < scene_.particles.size(); ++i)
      particles_->write(particles_message(scene_.particles[i].name, held_->frame,
                                          held_->capture_stamp_ns, simulation_->particles(i))
                            .message());
    states_.write(state_message(node_.node.name, held_->frame, held_->capture_stamp_ns,
                                simulation_->time_s(), scene_, simulation_->states())
                      .message());
  }

  // After the state, for which render_node waits.
  void publish_metrics() {
    if (!metrics_ || metrics_->readers() == 0) return;
    metrics_->write(metrics_message(node_.node.name, held_->frame, held_->capture_stamp_ns,
                                    simulation_->time_s(), simulation_->metrics())
                        .message());
  }

  node::NodeContext& node_;
  const config::Scene& scene_;
  std::unique_ptr<Simulation> simulation_;
  // Before all other readers, so that this process receives the session of a running replay before
  // the latched messages of that replay.
  node::ReplayMonitor replay_;
  node::FrameSetReader sets_;
  std::vector<frames::FrameSet> waiting_;  // until the spacings of their frames are known
  bool is_replayed_ = false;               // of the frames in waiting_
  bus::Reader<bus::topics::Command> commands_;
  SpacingPipe spacing_;
  node::FrameTracer traces_;
  bus::Writer<bus::topics::VirtualState> states_;
  bus::Writer<bus::topics::CollisionResult> collisions_;
  // Present if the scene has particles.
  std::optional<bus::Writer<bus::topics::Particles>> particles_;
  // Present if the scene has a history.
  std::optional<bus::Writer<bus::topics::HullComponents>> components_;
  // Present if the scene has an object that moves, or particles.
  std::optional<bus::Writer<bus::topics::SimulationMetrics>> metrics_;
  std::optional<std::int64_t> first_stamp_ns_;
  std::optional<frames::FrameSet> held_;
  Clock::time_point last_set_time_;
  SimulationCounters reported_;
};

}  // namespace

void run_simulation_pipe(node::NodeContext& node) {
  check_joint_clearance(node.deployment.scene);
  SimulationPipe(node).run();
}

}  // namespace fivepipe::sim
