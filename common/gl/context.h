// Creates an OpenGL 4.5 core context without a window through EGL: on a hardware device if there is
// one, otherwise on Mesa's surfaceless platform.
#pragma once
#include <string>

#include "common/gl/gl_error.h"

namespace fivepipe::gl {

// Owns the EGL display connection and context. The context is current in the constructing thread
// until destruction; use it from that thread only.
class GlContext {
 public:
  GlContext();  // throws GlError that lists each attempted display and its error
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  const std::string& renderer() const { return renderer_; }  // GL_RENDERER and GL_VERSION
  bool is_software() const;                                  // true for llvmpipe and softpipe

 private:
  void* display_ = nullptr;
  void* context_ = nullptr;
  std::string renderer_;
};

}  // namespace fivepipe::gl
