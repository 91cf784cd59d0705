#pragma once
#include <stdexcept>

namespace fivepipe::gl {

// OpenGL or EGL refused something; what() says what and why.
struct GlError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace fivepipe::gl
