// The clock of the host that captures, as seen from another host of the deployment.
#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "common/config/deployment.h"
#include "common/pipeline/bus/bus.h"

namespace fivepipe::node {

// Takes the offset from what `fivepipe up` of this host publishes (HostStatus).
class CaptureClock {
 public:
  // own_host, capture_host: names in the deployment.
  CaptureClock(bus::Bus& bus, std::string own_host, std::string capture_host);

  // Takes the newest offset. Call twice per second, from one thread.
  void update();
  // Returns the clock of the host that captures minus that of this host; nullopt before the first
  // comparison, and kMaxAge after the last. Thread-safe.
  std::optional<std::int64_t> offset_ns() const;
  // Why there is no offset, as a text for people; it has been missing for longer than `time`.
  std::string not_compared_text(std::chrono::seconds time) const;

  static constexpr std::chrono::seconds kMaxAge{10};
  // A larger offset is no clock, but a wrong message: a day.
  static constexpr std::int64_t kMaxOffset_ns = 86'400'000'000'000;

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::int64_t kUnknown = std::numeric_limits<std::int64_t>::min();
  const std::string own_host_, capture_host_;
  bus::Reader<bus::topics::HostStatus> in_;
  Clock::time_point newest_{};
  std::atomic<std::int64_t> offset_ns_{kUnknown};
};

// Returns nullptr if no other host has the clock of the capture: the first capture_node of the
// deployment runs on this host, there is none, or the deployment has one host. host, local: as in
// network_of().
std::unique_ptr<CaptureClock> capture_clock_of(const config::Deployment& deployment,
                                               const std::string& host, bool local, bus::Bus& bus);

}  // namespace fivepipe::node
