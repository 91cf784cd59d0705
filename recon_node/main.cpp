// A reconstruction pipe: volume-queries its tiles of the view (paper, section 3.2).
#include <optional>

#include "common/gl/context.h"
#include "recon_node/reconstruction_pipe.h"

namespace fivepipe {
namespace {

void run(NodeContext& node) {
  std::optional<GlContext> gl;
  if (config_of<ReconConfig>(node).backend == HullBackend::sweep) {
    gl.emplace();
    node.status.remark("gl", "gl: " + gl->renderer());
  }
  run_reconstruction_pipe(node);
}

}  // namespace
}  // namespace fivepipe

int main(int argc, char** argv) { return fivepipe::run_node("recon_node", argc, argv, fivepipe::run); }
