// Values that every function of numbers must bear or refuse.
#pragma once
#include <limits>

namespace fivepipe::test {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                        kInfinity = std::numeric_limits<double>::infinity();

}  // namespace fivepipe::test
