// A DDS domain for a benchmark alone.
#pragma once
#include <cstdint>
#include <string>

namespace fivepipe::node_bench {

// Nobody is heard there now. Throws std::runtime_error where there is none.
std::uint32_t free_domain(const std::string& profile);

}  // namespace fivepipe::node_bench
