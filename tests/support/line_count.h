// Counts the lines of a program's output.
#pragma once
#include <algorithm>
#include <cstddef>
#include <string>

namespace fivepipe::test {
inline std::ptrdiff_t line_count(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n');
}
}  // namespace fivepipe::test
