// A reconstruction pipe: volume-queries its tiles of the view (paper, section 3.2).
#include <optional>

#include "common/gl/context.h"
#include "common/gl/gl_error.h"
#include "recon_node/reconstruction_pipe.h"

namespace fivepipe {
namespace {

// OpenGL on a processor is slower than our own code for it.
HullBackend decide(NodeContext& node, std::optional<GlContext>& gl) {
  try {
    gl.emplace();
    if (!gl->is_software()) return HullBackend::gl;
    node.status.remark("backend", "backend auto: cpu, for OpenGL is " + gl->renderer());
  } catch (const GlError& e) {
    node.status.remark("backend", std::string("backend auto: cpu, for there is no OpenGL: ") + e.what());
  }
  gl.reset();
  return HullBackend::cpu;
}

void run(NodeContext& node) {
  std::optional<GlContext> gl;
  HullBackend backend = config_of<ReconConfig>(node).backend;
  if (backend == HullBackend::automatic) backend = decide(node, gl);
  if (backend != HullBackend::cpu && !gl) gl.emplace();
  if (gl) node.status.remark("gl", "gl: " + gl->renderer());
  run_reconstruction_pipe(node, backend);
}

}  // namespace
}  // namespace fivepipe

int main(int argc, char** argv) { return fivepipe::run_node("recon_node", argc, argv, fivepipe::run); }
