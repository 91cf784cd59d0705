// Looks for other deployments in the DDS domain (conflicts.h), whose frames would mix with those of
// this one.
#pragma once
#include <chrono>
#include <optional>
#include <set>
#include <string>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/hosts/conflicts.h"

namespace fivepipe::launch {

class ConflictSearch {
 public:
  // host: name of this machine in the deployment; empty: it names none.
  ConflictSearch(const std::string& deployment, const std::string& host, std::uint32_t domain);
  // The name that the participant of this run must have.
  std::string participant() const { return participant_name(own_); }

  // Looks for kDiscovery, with security longer (authentication_time()), on a bus of its own, before
  // anything is started. Returns why this run has to end; empty: it may start.
  std::string find_before_start(const bus::Network& network);
  // Call often. Looks twice per second. Returns why this run has to end. That is decided in the
  // first kStart: later, a run does not end because two networks were joined. After that, logs each
  // conflict once.
  std::string find(bus::Bus& bus);
  // What find() has returned; empty: this run may go on.
  const std::string& refusal() const { return refusal_; }

  static constexpr std::chrono::milliseconds kDiscovery{1500};
  static constexpr std::chrono::seconds kStart{10};

 private:
  using Clock = std::chrono::steady_clock;
  RunIdentity own_;
  std::uint32_t domain_;
  std::optional<Clock::time_point> started_;  // the first find()
  Clock::time_point next_{};
  // A run that gives way is seen only for a moment.
  std::set<std::string> seen_, reported_;
  std::string refusal_;
};

}  // namespace fivepipe::launch
