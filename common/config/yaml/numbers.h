// Numbers of configuration files: their allowed ranges, and their text form.
#pragma once
#include <limits>
#include <numbers>
#include <string>

namespace fivepipe::config {

// Allowed values, bounds included.
struct Range {
  double min, max;
  bool min_excluded = false;  // true: the minimum itself is not allowed
};
inline constexpr double kUnbounded = std::numeric_limits<double>::infinity();
inline constexpr Range kAny{-kUnbounded, kUnbounded};
inline constexpr Range kAnyDirection{-1e6, 1e6};  // of each component
inline constexpr Range kUnitRange{0, 1};
// One degree in radians.
inline constexpr double kDegree_rad = std::numbers::pi / 180;

// Returns false for NaN.
bool contains(Range range, double value);
// Returns a text such as "from 0 to 1", "at least 0" or "greater than 0 and at most 1".
std::string text_of(Range range);

struct ParsedNumber {
  bool is_number = false;
  double value = 0;  // infinite also if the text overflows a double
};
// Parses a decimal number, or YAML's .inf and .nan in any case, with or without the dot.
ParsedNumber parse_number(std::string text);

}  // namespace fivepipe::config
