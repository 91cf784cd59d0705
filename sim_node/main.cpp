// sim_node: collides the scene's virtual objects with the hull of each frame set and simulates
// their motion.
#include <optional>

#include "common/gl/context.h"
#include "sim_node/simulation_pipe.h"

namespace fivepipe::sim {
namespace {

void run(node::NodeContext& node) {
  std::optional<gl::GlContext> gl;
  if (node::config_of<config::SimConfig>(node).collision != config::CollisionBackend::cpu) {
    gl.emplace();
    node.status.set_gl_renderer(gl->renderer());
  }
  run_simulation_pipe(node);
}

}  // namespace
}  // namespace fivepipe::sim

int main(int argc, char** argv) {
  return fivepipe::node::run_node("sim_node", argc, argv, fivepipe::sim::run);
}
