#pragma once
#include <chrono>
#include <cstdint>

namespace fivepipe::base {

// CLOCK_REALTIME in ns since 1970, the clock of every timestamp.
inline std::int64_t now_realtime_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace fivepipe::base
