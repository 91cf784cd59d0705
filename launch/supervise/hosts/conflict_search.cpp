#include "launch/supervise/hosts/conflict_search.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <thread>

#include "common/base/machine.h"
#include "common/base/realtime.h"

namespace fivepipe::launch {
namespace {

constexpr std::chrono::milliseconds kPeriod{500};

}  // namespace

ConflictSearch::ConflictSearch(const std::string& deployment, const std::string& host,
                               std::uint32_t domain)
    : own_{deployment, host, base::host_name(), std::uint64_t(getpid()), base::now_realtime_ns()},
      domain_(domain) {}

std::string ConflictSearch::find_before_start(const bus::Network& network) {
  bus::Bus bus({domain_, network});
  // A reader makes this participant announce itself, and get answers, at once.
  const auto statuses = bus.reader<bus::topics::NodeStatus>();
  const auto discovery = kDiscovery + bus::authentication_time(network);
  for (const auto until = Clock::now() + discovery; refusal_.empty() && Clock::now() < until;
       std::this_thread::sleep_for(std::chrono::milliseconds(50))) {
    next_ = {};
    find(bus);
  }
  started_.reset();
  return refusal_;
}

std::string ConflictSearch::find(bus::Bus& bus) {
  const auto now = Clock::now();
  if (now < next_ || !refusal_.empty()) return refusal_;
  next_ = now + kPeriod;
  if (!started_) started_ = now;
  const bool is_starting = now < *started_ + kStart;
  std::vector<std::string> participants;
  for (const bus::EndpointDescription& endpoint : bus.endpoints())
    participants.push_back(endpoint.participant);
  for (const RunIdentity& other : conflicts_of(own_, participants)) {
    const std::string what = fmt::format("{} runs in domain {}", text_of(other), domain_);
    if (is_starting && gives_way(own_, other, base::now_realtime_ns()))
      refusal_ = what + "; stop it, or choose another --domain";
    else if (!is_starting && seen_.contains(what) && reported_.insert(what).second)
      spdlog::error("{}, too: the frames of both mix; stop one of them", what);
    seen_.insert(what);
  }
  return refusal_;
}

}  // namespace fivepipe::launch
