#include "launch/supervise/hosts/rival_search.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "common/base/machine.h"
#include "common/base/realtime.h"

namespace fivepipe::launch {
namespace {

constexpr std::chrono::milliseconds kPeriod{500};

}  // namespace

RivalSearch::RivalSearch(const std::string& deployment, const std::string& host,
                         std::uint32_t domain)
    : own_{deployment, host, base::host_name(), std::uint64_t(getpid()), base::now_realtime_ns()},
      domain_(domain) {}

std::string RivalSearch::find(bus::Bus& bus) {
  const auto now = Clock::now();
  if (now < next_ || !refusal_.empty()) return refusal_;
  next_ = now + kPeriod;
  std::vector<std::string> participants;
  for (const bus::EndpointDescription& endpoint : bus.endpoints())
    participants.push_back(endpoint.participant);
  for (const RunIdentity& rival : rivals_of(own_, participants)) {
    const std::string what = fmt::format("{} runs in domain {}", text_of(rival), domain_);
    if (now < started_ + kStart && gives_way(own_, rival))
      refusal_ = what + "; stop it, or choose another --domain";
    else if (reported_.insert(what).second)
      spdlog::error("{}, too: the frames of both mix; stop one of them", what);
  }
  return refusal_;
}

}  // namespace fivepipe::launch
