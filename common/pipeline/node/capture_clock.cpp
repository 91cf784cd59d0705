#include "common/pipeline/node/capture_clock.h"

#include <string_view>
#include <utility>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::node {
namespace {

// The program that compares the clocks while a deployment runs.
constexpr std::string_view kProgram = "up";

}  // namespace

CaptureClock::CaptureClock(bus::Bus& bus, std::string own_host, std::string capture_host)
    : own_host_(std::move(own_host)),
      capture_host_(std::move(capture_host)),
      in_(bus.polled_reader<bus::topics::HostStatus>()) {}

void CaptureClock::update() {
  for (const auto& sample : in_.take()) {
    if (!sample.valid() || own_host_ != sample->host || kProgram != sample->program) continue;
    for (const fivepipe_v1_ClockAnswer& answer : messages::span_of(sample->clocks))
      if (capture_host_ == answer.host && kProgram == answer.program && answer.error_ns >= 0 &&
          base::distance_ns(answer.offset_ns, 0) < kMaxOffset_ns) {
        offset_ns_ = answer.offset_ns;
        newest_ = Clock::now();
      }
  }
  if (Clock::now() - newest_ > kMaxAge) offset_ns_ = kUnknown;
}

std::optional<std::int64_t> CaptureClock::offset_ns() const {
  const std::int64_t offset_ns = offset_ns_;
  return offset_ns == kUnknown ? std::nullopt : std::optional(offset_ns);
}

std::string CaptureClock::not_compared_text(std::chrono::seconds time) const {
  return "no clock comparison with host " + capture_host_ + ", which captures, for more than " +
         std::to_string(time.count()) +
         " s; is `fivepipe up` running on both hosts? Latencies since the capture are not "
         "corrected";
}

std::unique_ptr<CaptureClock> capture_clock_of(const config::Deployment& deployment,
                                               const std::string& host, bool local, bus::Bus& bus) {
  const config::Node* capture = config::first_capture_node(deployment);
  if (!capture || local || deployment.hosts.size() < 2) return nullptr;
  const std::string own = config::own_host(deployment.hosts, host, deployment.file).name;
  if (own == capture->host) return nullptr;
  return std::make_unique<CaptureClock>(bus, own, capture->host);
}

}  // namespace fivepipe::node
