#include "benchmarks/nodes/free_domain.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "common/pipeline/bus/bus.h"

namespace fivepipe::node_bench {
namespace {

using namespace std::chrono_literals;

// Ports of these kDomainCount lie below those that the kernel gives to others.
constexpr std::uint32_t kFirstDomain = 60, kDomainCount = 40;
constexpr auto kListeningTime = 400ms;

}  // namespace

std::uint32_t free_domain(const std::string& profile) {
  for (std::uint32_t i = 0; i < kDomainCount; ++i) {
    const std::uint32_t domain = kFirstDomain + (std::uint32_t(getpid()) + i) % kDomainCount;
    bus::Bus bus({domain, profile, "bench"});
    for (const auto until = std::chrono::steady_clock::now() + kListeningTime;
         std::chrono::steady_clock::now() < until;)
      bus.wait(20ms);
    const auto endpoints = bus.endpoints();
    if (std::all_of(endpoints.begin(), endpoints.end(),
                    [](const bus::EndpointDescription& endpoint) { return endpoint.own; }))
      return domain;
  }
  throw std::runtime_error("no DDS domain is free: somebody is heard in all of " +
                           std::to_string(kFirstDomain) + " to " +
                           std::to_string(kFirstDomain + kDomainCount - 1));
}

}  // namespace fivepipe::node_bench
