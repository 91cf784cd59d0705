// The simulation pipe: collides the scene's virtual objects with the hull of each frame set and moves them on.
#include <optional>

#include "common/gl/context.h"
#include "common/node/frame_set_reader.h"
#include "common/node/run_node.h"
#include "sim_node/messages.h"

namespace fivepipe {
namespace {

void count(NodeStatusReporter& status, const CollisionReport& report) {
  if (!report.collision.colliding()) return;
  status.count("collisions/" + report.name);
  status.count("collision_points/" + report.name, report.collision.points.size());
}

// What the simulation could not do as it should, since the last call.
void count_new(NodeStatusReporter& status, const SimulationCounters& now, SimulationCounters& told) {
  const auto tell = [&](const char* name, std::uint64_t count, std::uint64_t before) {
    if (count > before) status.count(name, count - before);
  };
  tell("contacts", now.contacts, told.contacts);
  tell("contacts_unrecovered", now.unrecovered, told.unrecovered);
  tell("contacts_still_colliding", now.still_colliding, told.still_colliding);
  tell("objects_put_back", now.put_back, told.put_back);
  tell("stamps_went_back", now.stamps_went_back, told.stamps_went_back);
  tell("milliseconds_skipped", std::uint64_t(1e3 * now.skipped_s), std::uint64_t(1e3 * told.skipped_s));
  tell("points_unconfirmed", now.detection.points_unconfirmed, told.detection.points_unconfirmed);
  told = now;
}

void run(NodeContext& node) {
  const GlContext gl;
  node.status.remark("gl", "gl: " + gl.renderer());
  const Scene& scene = node.deployment.scene;
  Simulation simulation(scene, config_of<SimConfig>(node));
  FrameSetReader sets(node.bus, node.deployment.rig, node.status);
  auto commands = node.bus.reader<topics::Command>();
  auto states = node.bus.writer<topics::VirtualState>();
  auto collisions = node.bus.writer<topics::CollisionResult>();

  // Seconds since the first stamp: those since 1970 leave a double too few digits.
  std::optional<std::int64_t> first_stamp_ns;
  SimulationCounters told;
  while (running()) {
    node.bus.wait(kMaxWait);
    for (const auto& command : commands.take())
      if (command.valid()) apply(*command, node.node.name, simulation);
    for (const FrameSet& set : sets.take()) {
      {
        const StageTimer timer(node.status, "simulate");
        if (!first_stamp_ns) first_stamp_ns = set.capture_stamp_ns;
        simulation.advance_to(1e-9 * double(set.capture_stamp_ns - *first_stamp_ns), set.silhouettes);
      }
      count_new(node.status, simulation.counters(), told);
      for (const CollisionReport& report : simulation.collisions()) {
        count(node.status, report);
        collisions.write(collision_message(set.frame, set.capture_stamp_ns, report).message());
      }
      states.write(state_message(node.node.name, set.frame, set.capture_stamp_ns, simulation.time_s(), scene, simulation.states()).message());
      node.status.frame_handled(set.frame);
    }
  }
}

}  // namespace
}  // namespace fivepipe

int main(int argc, char** argv) { return fivepipe::run_node("sim_node", argc, argv, fivepipe::run); }
