// Text about a round of a replay.
#pragma once
#include <string>

#include "common/recording/replay/replayer.h"

namespace fivepipe::launch {

// Messages by topic, frames by node, and what differs from a lossless replay.
std::string text_of(const replay::ReplayCounts& counts);

}  // namespace fivepipe::launch
