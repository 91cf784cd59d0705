// An OpenGL context for tests, which fails the test if the code under test left an OpenGL error.
#pragma once
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include "common/gl/context.h"

namespace fivepipe::test {

class CheckedGlContext : public gl::GlContext {
 public:
  ~CheckedGlContext() { EXPECT_EQ(glGetError(), GLenum(GL_NO_ERROR)); }
};

}  // namespace fivepipe::test
