// Measures rate, intervals and latencies of a topic: the work of `fivepipe hz`.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "common/pipeline/bus/profile.h"

namespace fivepipe::launch {

struct HzRequest {
  std::string topic;           // as resolve_topic() accepts it
  std::filesystem::path file;  // a recording; empty: the bus
  double once_s = 0;           // one table over this time; 0: a table per second until interrupted
  std::uint32_t domain = 0;
  bus::Network network = {};
};

// Prints tables to stdout. Returns the exit code: 0 done, 1 the recording is damaged or stdout
// fails, 3 no message within once_s, 130 if `interrupted` returned true before the result. Throws
// UsageError for an unknown topic, and as Recording does.
int measure_rate(const HzRequest& request, const std::function<bool()>& interrupted);

}  // namespace fivepipe::launch
