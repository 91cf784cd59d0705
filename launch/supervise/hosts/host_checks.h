// Decides whether the hosts of a deployment are alike enough to run it together. Pure.
#pragma once
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "launch/supervise/hosts/clock_comparison.h"
#include "launch/supervise/hosts/host_state.h"

namespace fivepipe::launch {

struct ComparedHost {
  HostState state;
  std::optional<ClockOffset> clock;  // nullopt: not compared yet
};

class HostChecks {
 public:
  // is_any_clock_accepted: an offset above kClockLimit_ns is no reason to end.
  explicit HostChecks(bool is_any_clock_accepted) : is_any_clock_accepted_(is_any_clock_accepted) {}

  // Returns the new texts to log: differences, and clocks that have become worse. Only while
  // is_starting, a clock is a reason to end: later, a run does not end because somebody has set a
  // clock.
  std::vector<std::string> check(const HostState& own, const std::vector<ComparedHost>& others,
                                 bool is_starting);
  // Why this run has to end; empty: it may go on.
  const std::string& refusal() const { return refusal_; }

 private:
  bool is_any_clock_accepted_;
  // A peer can state any version and any files: this many differences are logged.
  static constexpr std::size_t kMaxReported = 256;
  std::set<std::string> reported_;                // differences
  std::map<HostSpeaker, ClockVerdict> clock_of_;  // the worst one reported
  std::string refusal_;
};

}  // namespace fivepipe::launch
