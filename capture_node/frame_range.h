// Ranges of frames on a command line.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

namespace fivepipe::capture {

// Frames first, first + step, ... up to and including last.
struct FrameRange {
  std::int64_t first = 0, last = 0, step = 1;
};

// More than a year at 30 frames per second.
inline constexpr std::int64_t kMaxFrame = 1'000'000'000;

// Parses N, A:B (both included) or A:B:STEP; numbers from 0 to kMaxFrame, A <= B, STEP >= 1.
// Returns nullopt if the text is none of these.
std::optional<FrameRange> parse_frame_range(const std::string& text);

}  // namespace fivepipe::capture
