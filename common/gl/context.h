// An OpenGL 4.5 core context without a window, through EGL: a hardware device where there is one,
// else Mesa's surfaceless platform.
#pragma once
#include <string>

#include "common/gl/gl_error.h"

namespace fivepipe::gl {

// Owns the EGL display connection and context; current in the thread that made it until destroyed.
// One thread at a time.
class GlContext {
 public:
  GlContext();  // throws GlError saying what was tried and what each attempt answered
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  const std::string& renderer() const { return renderer_; }  // GL_RENDERER and GL_VERSION
  bool is_software() const;                                  // llvmpipe or softpipe

 private:
  void* display_ = nullptr;
  void* context_ = nullptr;
  std::string renderer_;
};

}  // namespace fivepipe::gl
