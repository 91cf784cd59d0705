// Assigns each test process its own DDS domain, so that concurrent tests do not see each other.
#pragma once
#include <unistd.h>

#include <cstdint>

namespace fivepipe::test {
inline std::uint32_t own_domain() { return 20 + std::uint32_t(getpid()) % 200; }
}  // namespace fivepipe::test
