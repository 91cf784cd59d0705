#include "launch/supervise/hosts/free_domain.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "common/pipeline/bus/bus.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;

// The UDP ports of these domains are below the kernel's ephemeral ports.
constexpr std::uint32_t kFirstDomain = 60, kDomainCount = 40;
constexpr auto kDiscoveryTime = 400ms;

}  // namespace

std::uint32_t free_domain() {
  for (std::uint32_t i = 0; i < kDomainCount; ++i) {
    const std::uint32_t domain = kFirstDomain + (std::uint32_t(getpid()) + i) % kDomainCount;
    bus::Bus bus({.domain = domain, .participant = "search"});
    for (const auto until = std::chrono::steady_clock::now() + kDiscoveryTime;
         std::chrono::steady_clock::now() < until;)
      bus.wait(20ms);
    const auto endpoints = bus.endpoints();
    if (std::all_of(endpoints.begin(), endpoints.end(),
                    [](const bus::EndpointDescription& endpoint) { return endpoint.own; }))
      return domain;
  }
  throw std::runtime_error(fmt::format("DDS domains {} to {} are all in use; stop other nodes",
                                       kFirstDomain, kFirstDomain + kDomainCount - 1));
}

}  // namespace fivepipe::launch
