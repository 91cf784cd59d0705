#include "common/config/yaml/numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>

namespace fivepipe::config {

bool contains(Range range, double value) {
  return (range.min_excluded ? value > range.min : value >= range.min) && value <= range.max;
}

std::string text_of(Range range) {
  if (!std::isfinite(range.min)) return fmt::format("at most {:.10g}", range.max);
  const char* const bound = range.min_excluded ? "greater than" : "at least";
  if (!std::isfinite(range.max)) return fmt::format("{} {:.10g}", bound, range.min);
  if (range.min_excluded)
    return fmt::format("{} {:.10g} and at most {:.10g}", bound, range.min, range.max);
  return fmt::format("from {:.10g} to {:.10g}", range.min, range.max);
}

ParsedNumber parse_number(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const bool is_negative = text.starts_with('-');
  if (is_negative || text.starts_with('+')) text.erase(0, 1);
  if (text == ".inf" || text == "inf" || text == "infinity")
    return {true, std::numeric_limits<double>::infinity()};
  if (text == ".nan" || text == "nan") return {true, std::numeric_limits<double>::quiet_NaN()};
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || text.empty() || text.front() == '-') return {};
  if (error == std::errc::result_out_of_range)
    return {true, std::numeric_limits<double>::infinity()};
  return {true, is_negative ? -value : value};
}

}  // namespace fivepipe::config
