// Fails a test if the code under test left an OpenGL error.
#pragma once
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "common/gl/context.h"

namespace fivepipe::test {

// Checks the current context. Tests that share a context call this in TearDown().
inline void expect_no_gl_error() { EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)); }

// A context for one test, which checks it at its end.
class CheckedGlContext : public gl::GlContext {
 public:
  CheckedGlContext() : gl::GlContext() {}  // Clang refuses a const object of a defaulted one
  ~CheckedGlContext() { expect_no_gl_error(); }
};

}  // namespace fivepipe::test
