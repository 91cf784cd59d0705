// A GPU that is reset, for tests. Preloaded into a program (LD_PRELOAD): if the file that the
// environment names in FIVEPIPE_TEST_GPU_RESET exists, removes it and reports a reset once.
#include <epoxy/gl.h>
#include <unistd.h>

#include <cstdlib>

namespace {

GLenum reset_status() {
  const char* const file = std::getenv("FIVEPIPE_TEST_GPU_RESET");
  return file && unlink(file) == 0 ? GL_GUILTY_CONTEXT_RESET : GL_NO_ERROR;
}

// libepoxy calls each function of OpenGL by such a pointer.
__attribute__((constructor)) void replace() { epoxy_glGetGraphicsResetStatus = reset_status; }

}  // namespace
