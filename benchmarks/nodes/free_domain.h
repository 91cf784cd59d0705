// A DDS domain that a benchmark has for itself.
#pragma once
#include <cstdint>

namespace fivepipe::node_bench {

// Returns a domain of the loopback interface in which no other endpoint is discovered within 0.4 s.
// Throws std::runtime_error if every candidate is in use.
std::uint32_t free_domain();

}  // namespace fivepipe::node_bench
