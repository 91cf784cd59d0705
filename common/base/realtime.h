// CLOCK_REALTIME in ns since 1970, the clock of every timestamp, and arithmetic on timestamps of
// other processes and of files, whose differences can overflow.
#pragma once
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace fivepipe::base {

// How far a test sets the clock of this process ahead, by this environment variable [ms].
inline constexpr const char* kTestClockVariable = "FIVEPIPE_TEST_CLOCK_OFFSET_MS";
inline std::int64_t test_clock_offset_ns() {
  static const std::int64_t offset_ns = [] {
    const char* const ms = std::getenv(kTestClockVariable);
    return ms ? std::int64_t(1'000'000) * std::atoi(ms) : 0;
  }();
  return offset_ns;
}

inline std::int64_t now_realtime_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
             .count() +
         test_clock_offset_ns();
}

// Returns a - b, saturated to the range of the type.
inline std::int64_t difference_ns(std::int64_t a_ns, std::int64_t b_ns) {
  std::int64_t difference;
  if (!__builtin_sub_overflow(a_ns, b_ns, &difference)) return difference;
  return a_ns < b_ns ? INT64_MIN : INT64_MAX;
}

// Returns the time between two stamps, saturated.
inline std::int64_t distance_ns(std::int64_t a_ns, std::int64_t b_ns) {
  return a_ns < b_ns ? difference_ns(b_ns, a_ns) : difference_ns(a_ns, b_ns);
}

// Returns the time from b to a [s], saturated.
inline double difference_s(std::int64_t a_ns, std::int64_t b_ns) {
  return 1e-9 * double(difference_ns(a_ns, b_ns));
}

// Returns the stamp `seconds` later, saturated. `seconds` must not be NaN.
inline std::int64_t later_by_s(std::int64_t stamp_ns, double seconds) {
  // 2^62 ns are 146 years. INT64_MAX as a double would be 2^63, which does not fit.
  constexpr double kMax_ns = 0x1p62;
  const double later_ns = std::fmin(std::fmax(1e9 * seconds, -kMax_ns), kMax_ns);
  std::int64_t sum;
  if (!__builtin_add_overflow(stamp_ns, std::int64_t(later_ns), &sum)) return sum;
  return later_ns < 0 ? INT64_MIN : INT64_MAX;
}

}  // namespace fivepipe::base
