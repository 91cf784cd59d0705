// The recording that later versions must read.
#pragma once

namespace fivepipe::test {

inline constexpr const char* kKeptRecording = FIVEPIPE_SOURCE_DIR "/tests/recordings/v1.mcap";

}  // namespace fivepipe::test
