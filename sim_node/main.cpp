// The simulation pipe: collides the scene's virtual objects with the hull of each frame set and moves them on.
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

void run(NodeContext& node) {
  const GlContext gl;
  node.status.remark("gl", "gl: " + gl.renderer());
  const Scene& scene = node.deployment.scene;
  Simulation simulation(scene, config_of<SimConfig>(node));
  FrameSetReader sets(node.bus, node.deployment.rig, node.status);
  auto commands = node.bus.reader<topics::Command>();
  auto states = node.bus.writer<topics::VirtualState>();
  auto collisions = node.bus.writer<topics::CollisionResult>();

  while (running()) {
    node.bus.wait(kMaxWait);
    for (const auto& command : commands.take())
      if (command.valid()) apply(*command, node.node.name, simulation);
    for (const FrameSet& set : sets.take()) {
      {
        const StageTimer timer(node.status, "simulate");
        simulation.advance_to(1e-9 * double(set.capture_stamp_ns), set.silhouettes);
      }
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
