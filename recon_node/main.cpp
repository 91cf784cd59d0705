// A reconstruction pipe: computes its tiles of the view by volume queries (paper, section 3.2).
#include <optional>

#include "common/gl/context.h"
#include "recon_node/reconstruction_pipe.h"

namespace fivepipe::recon {
namespace {

void run(node::NodeContext& node) {
  std::optional<gl::GlContext> gl;
  config::HullBackend backend = node::config_of<config::ReconConfig>(node).backend;
  // docs/gpu.md: cpu was faster than gl on every machine, also on one with a GPU.
  if (backend == config::HullBackend::automatic) backend = config::HullBackend::cpu;
  if (backend != config::HullBackend::cpu) gl.emplace();
  if (gl) node.status.set_gl_renderer(gl->renderer());
  run_reconstruction_pipe(node, backend);
}

}  // namespace
}  // namespace fivepipe::recon

int main(int argc, char** argv) {
  return fivepipe::node::run_node("recon_node", argc, argv, fivepipe::recon::run);
}
