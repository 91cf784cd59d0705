// Variants of embedded shaders.
#include "common/gl/shader_source.h"

#include <gtest/gtest.h>

namespace fivepipe::gl {
namespace {

TEST(ShaderSource, DefinesFollowTheVersionLine) {
  EXPECT_EQ(with_defines("// A comment.\n#version 450 core\nvoid main() {}\n", "#define FLAT\n"),
            "// A comment.\n#version 450 core\n#define FLAT\nvoid main() {}\n");
}

TEST(ShaderSource, SourceWithoutVersionLineThrows) {
  EXPECT_THROW(with_defines("void main() {}\n", ""), std::invalid_argument);
  EXPECT_THROW(with_defines("#version 450 core", ""), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::gl
