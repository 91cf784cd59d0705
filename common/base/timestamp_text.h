// Formats timestamps (CLOCK_REALTIME, ns) in local time.
#pragma once
#include <cstdint>
#include <string>

namespace fivepipe::base {

std::string local_date_and_time(std::int64_t stamp_ns);  // "2026-11-22 05:09:12.345678 +0100"
std::string local_time_of_day(std::int64_t stamp_ns);    // "05:09:12.345678"

}  // namespace fivepipe::base
