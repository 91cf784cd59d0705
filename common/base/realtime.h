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

// Returns a - b, saturated to the range of the type. Stamps come from other processes and files,
// and the difference of two arbitrary stamps overflows.
inline std::int64_t difference_ns(std::int64_t a_ns, std::int64_t b_ns) {
  std::int64_t difference;
  if (!__builtin_sub_overflow(a_ns, b_ns, &difference)) return difference;
  return a_ns < b_ns ? INT64_MIN : INT64_MAX;
}

// Returns the time between two stamps, saturated.
inline std::int64_t distance_ns(std::int64_t a_ns, std::int64_t b_ns) {
  return a_ns < b_ns ? difference_ns(b_ns, a_ns) : difference_ns(a_ns, b_ns);
}

// Returns the time from b to a, saturated.
inline double difference_s(std::int64_t a_ns, std::int64_t b_ns) {
  return 1e-9 * double(difference_ns(a_ns, b_ns));
}

}  // namespace fivepipe::base
