// A second and a millisecond, in nanoseconds.
#pragma once
#include <cstdint>

namespace fivepipe::test {

inline constexpr std::int64_t s = 1'000'000'000, ms = 1'000'000;

}  // namespace fivepipe::test
