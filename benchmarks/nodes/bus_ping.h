// Measures the bus alone: round trips of messages of given sizes through fivepipe's bus and through
// ddsperf, which is part of Cyclone DDS.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace fivepipe::node_bench {

struct BusTimes {
  std::size_t size_bytes = 0;   // serialized
  std::vector<double> ours_us;  // half of each round trip
  // ddsperf's medians of half a round trip, per round: with a waitset, as our bus, and with a
  // listener in the receive thread.
  std::vector<double> ddsperf_us, ddsperf_listener_us;
};

// Measures the sizes and methods alternately, in `rounds` rounds of a few seconds per size. Throws
// std::runtime_error if ddsperf is missing or prints no times, if a message does not return, or
// after a signal.
std::vector<BusTimes> time_bus(const std::vector<std::size_t>& sizes_bytes, int rounds);

// The other end: answers until SIGTERM. time_bus() starts it in its own process.
int echo_on_bus(std::uint32_t domain);

}  // namespace fivepipe::node_bench
