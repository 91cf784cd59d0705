// Reads files of the checkout.
#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace fivepipe::test {

inline const std::filesystem::path kRoot = FIVEPIPE_SOURCE_DIR;

// `file` is absolute or relative to kRoot.
inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(kRoot / file, std::ios::binary);
  EXPECT_TRUE(in) << file;
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace fivepipe::test
