// Progress reports of long sessions.
#pragma once
#include <chrono>

namespace fivepipe::replay {

// A recording or replaying session logs its progress this often.
inline constexpr std::chrono::seconds kProgressPeriod{5};

}  // namespace fivepipe::replay
