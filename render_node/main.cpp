// The parent pipe: puts the reconstruction's tiles and the simulation's state of one frame together
// and composites them.
#include "common/gl/context.h"
#include "render_node/parent_pipe.h"

namespace fivepipe::render {
namespace {

void run(node::NodeContext& node) {
  const gl::GlContext gl;
  node.status.set_gl_renderer(gl.renderer());
  run_parent_pipe(node);
}

}  // namespace
}  // namespace fivepipe::render

int main(int argc, char** argv) {
  return fivepipe::node::run_node("render_node", argc, argv, fivepipe::render::run);
}
