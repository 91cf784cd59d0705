// The simulation pipe: collides the scene's virtual objects with the hull of each frame set and moves them on.
#include <optional>

#include "common/gl/context.h"
#include "sim_node/simulation_pipe.h"

namespace fivepipe {
namespace {

void run(NodeContext& node) {
  std::optional<GlContext> gl;
  if (config_of<SimConfig>(node).collision != CollisionBackend::cpu) {
    gl.emplace();
    node.status.remark("gl", "gl: " + gl->renderer());
  }
  run_simulation_pipe(node);
}

}  // namespace
}  // namespace fivepipe

int main(int argc, char** argv) { return fivepipe::run_node("sim_node", argc, argv, fivepipe::run); }
