#pragma once
#include <stdexcept>

namespace fivepipe::gl {

// An OpenGL or EGL call failed; what() names the operation and the reason.
struct GlError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace fivepipe::gl
