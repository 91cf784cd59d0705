// The bus alone: round trips of messages of given sizes through this project's bus, beside ddsperf,
// which comes with Cyclone DDS.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace fivepipe::node_bench {

struct BusTimes {
  std::size_t size_bytes = 0;   // serialised
  std::vector<double> ours_us;  // half a round trip, by round trip
  std::vector<double> ddsperf_us,
      ddsperf_listener_us;  // medians of half a round trip, by round; waiting as our bus does
                            // (waitset), and in its receive thread
};

// Interleaved: `rounds` of a few seconds each, for each size. Throws std::runtime_error where
// ddsperf is missing or says something else.
std::vector<BusTimes> time_bus(const std::vector<std::size_t>& sizes_bytes, int rounds,
                               const std::string& profile);

// The other end: answers until SIGTERM. Started by time_bus as a process of its own.
int echo_on_bus(std::uint32_t domain, const std::string& profile);

}  // namespace fivepipe::node_bench
