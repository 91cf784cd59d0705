#include "capture_node/frame_range.h"

#include <array>
#include <charconv>

namespace fivepipe::capture {

std::optional<FrameRange> parse_frame_range(const std::string& text) {
  std::array<std::int64_t, 3> numbers{};
  std::size_t count = 0;
  const char *at = text.data(), *const end = text.data() + text.size();
  while (true) {
    if (count == numbers.size()) return std::nullopt;
    const auto [after, error] = std::from_chars(at, end, numbers[count]);
    if (error != std::errc() || numbers[count] < 0 || numbers[count] > kMaxFrame)
      return std::nullopt;
    ++count;
    if (after == end) break;
    if (*after != ':') return std::nullopt;
    at = after + 1;
  }
  const FrameRange range{numbers[0], count > 1 ? numbers[1] : numbers[0],
                         count > 2 ? numbers[2] : 1};
  if (range.last < range.first || range.step < 1) return std::nullopt;
  return range;
}

}  // namespace fivepipe::capture
