#include "benchmarks/nodes/free_domain.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "common/pipeline/bus/bus.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;

// Ports of these domains lie below those that the kernel gives to others.
constexpr std::uint32_t first_domain = 60, domains = 40;
constexpr auto listening_time = 400ms;

}  // namespace

std::uint32_t free_domain(const std::string& profile) {
  for (std::uint32_t i = 0; i < domains; ++i) {
    const std::uint32_t domain = first_domain + (std::uint32_t(getpid()) + i) % domains;
    bus::Bus bus({domain, profile, "bench"});
    for (const auto until = std::chrono::steady_clock::now() + listening_time;
         std::chrono::steady_clock::now() < until;)
      bus.wait(20ms);
    const auto endpoints = bus.endpoints();
    if (std::all_of(endpoints.begin(), endpoints.end(),
                    [](const bus::EndpointDescription& endpoint) { return endpoint.own; }))
      return domain;
  }
  throw std::runtime_error("no DDS domain is free: somebody is heard in all of " +
                           std::to_string(first_domain) + " to " +
                           std::to_string(first_domain + domains - 1));
}

}  // namespace fivepipe::node_bench
