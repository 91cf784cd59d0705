// Queries of the text that a program prints.
#pragma once
#include <algorithm>
#include <cstddef>
#include <string>

namespace fivepipe::test {

inline std::ptrdiff_t line_count(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n');
}
inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace fivepipe::test
