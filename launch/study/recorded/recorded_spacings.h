// The spacings to which an experimenter moved a part while a session was recorded.
#pragma once
#include <string>
#include <vector>

#include "common/recording/files/recording.h"

namespace fivepipe::study {

struct RecordedSpacing {
  double time_s = 0;  // of the first frame with it, since the recording's start; at least 0
  double spacing_m = 0;
};

// Returns the spacings of the part in the order of the recording; empty if it has none, as before
// fivepipe recorded them. Skips damaged chunks and messages.
std::vector<RecordedSpacing> recorded_spacings(const recording::Recording& recording,
                                               const std::string& part);

}  // namespace fivepipe::study
