// A DDS domain that a program has for itself.
#pragma once
#include <cstdint>

namespace fivepipe::launch {

// Returns a domain of the loopback interface in which no other endpoint is discovered within 0.4 s.
// Throws std::runtime_error if every candidate is in use.
std::uint32_t free_domain();

}  // namespace fivepipe::launch
