// The recording that later versions must read.
#pragma once
#include <string>

namespace fivepipe::test {

inline const std::string kKeptRecording = FIVEPIPE_SOURCE_DIR "/tests/recordings/v1.mcap";

}  // namespace fivepipe::test
