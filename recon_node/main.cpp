// A reconstruction pipe: volume-queries its tiles of the view (paper, section 3.2).
#include <optional>

#include "common/gl/context.h"
#include "common/gl/gl_error.h"
#include "recon_node/reconstruction_pipe.h"

namespace fivepipe::recon {
namespace {

// OpenGL on a processor is slower than our own code for it.
config::HullBackend decide(node::NodeContext& node, std::optional<gl::GlContext>& gl) {
  try {
    gl.emplace();
    if (!gl->is_software()) return config::HullBackend::gl;
    node.status.diagnostic("backend auto", "using cpu; OpenGL is software: " + gl->renderer());
  } catch (const gl::GlError& e) {
    node.status.diagnostic("backend auto", std::string("using cpu; no OpenGL: ") + e.what());
  }
  gl.reset();
  return config::HullBackend::cpu;
}

void run(node::NodeContext& node) {
  std::optional<gl::GlContext> gl;
  config::HullBackend backend = node::config_of<config::ReconConfig>(node).backend;
  if (backend == config::HullBackend::automatic) backend = decide(node, gl);
  if (backend != config::HullBackend::cpu && !gl) gl.emplace();
  if (gl) node.status.set_gl_renderer(gl->renderer());
  run_reconstruction_pipe(node, backend);
}

}  // namespace
}  // namespace fivepipe::recon

int main(int argc, char** argv) {
  return fivepipe::node::run_node("recon_node", argc, argv, fivepipe::recon::run);
}
