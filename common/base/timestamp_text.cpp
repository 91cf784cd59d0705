#include "common/base/timestamp_text.h"

#include <cstdio>
#include <ctime>

namespace fivepipe::base {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

// Inserts the microseconds between the two strftime formats.
std::string formatted(std::int64_t stamp_ns, const char* before, const char* after) {
  std::int64_t seconds = stamp_ns / kNsPerSecond, rest_ns = stamp_ns % kNsPerSecond;
  if (rest_ns < 0) {
    --seconds;
    rest_ns += kNsPerSecond;
  }
  const std::time_t time = seconds;
  std::tm local{};
  localtime_r(&time, &local);
  char front[64] = "", micros[16], back[16] = "";
  std::strftime(front, sizeof front, before, &local);
  std::snprintf(micros, sizeof micros, ".%06lld", static_cast<long long>(rest_ns / 1000));
  if (*after) std::strftime(back, sizeof back, after, &local);
  return std::string(front) + micros + back;
}

}  // namespace

std::string local_date_and_time(std::int64_t stamp_ns) {
  return formatted(stamp_ns, "%Y-%m-%d %H:%M:%S", " %z");
}
std::string local_time_of_day(std::int64_t stamp_ns) { return formatted(stamp_ns, "%H:%M:%S", ""); }

}  // namespace fivepipe::base
