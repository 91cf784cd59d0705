// NaN and infinity, which every function must accept or reject.
#pragma once
#include <limits>

namespace fivepipe::test {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                        kInfinity = std::numeric_limits<double>::infinity();

}  // namespace fivepipe::test
