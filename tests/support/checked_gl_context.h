// Fails a test if the code under test left an OpenGL error.
#pragma once
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "common/gl/context.h"

namespace fivepipe::test {

// Of the current context. A context that several tests share is checked after each one.
inline void expect_no_gl_error() { EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)); }

// A context of one test.
class CheckedGlContext : public gl::GlContext {
 public:
  ~CheckedGlContext() { expect_no_gl_error(); }
};

}  // namespace fivepipe::test
