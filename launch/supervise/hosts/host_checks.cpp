#include "launch/supervise/hosts/host_checks.h"

#include <fmt/format.h>

#include "common/base/realtime.h"
#include "common/base/text_table.h"

namespace fivepipe::launch {

std::vector<std::string> HostChecks::check(const HostState& own,
                                           const std::vector<ComparedHost>& others,
                                           bool is_starting) {
  std::vector<std::string> texts;
  for (const ComparedHost& other : others) {
    for (const std::string& difference : differences(own, other.state))
      if (const std::string text = base::printable(difference);
          reported_.size() < kMaxReported && reported_.insert(text).second)
        texts.push_back(text);
    const std::string& host = other.state.speaker.host;
    if (!other.clock || host == own.speaker.host) continue;
    const ClockVerdict verdict = verdict_on(*other.clock);
    ClockVerdict& reported = clock_of_[other.state.speaker];
    const std::string measured =
        fmt::format("the clock of host {} is {}", base::printable(host), text_of(*other.clock));
    if (verdict == ClockVerdict::refused && is_starting && !is_any_clock_accepted_)
      refusal_ = measured +
                 ". Synchronise the clocks, for example by chrony on each host, or start with "
                 "--allow-clock-offset";
    if (verdict > reported)
      texts.push_back(measured +
                      "; latencies between the hosts are corrected by that. Synchronise the "
                      "clocks, for example by chrony on each host");
    // An offset near the limit is not logged again and again.
    if (verdict > reported || base::distance_ns(other.clock->offset_ns, 0) < kClockWarning_ns / 2)
      reported = verdict;
  }
  return texts;
}

}  // namespace fivepipe::launch
