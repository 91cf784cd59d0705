// Looks for other deployments in the DDS domain (rivals.h).
#pragma once
#include <chrono>
#include <set>
#include <string>

#include "common/pipeline/bus/bus.h"
#include "launch/supervise/hosts/rivals.h"

namespace fivepipe::launch {

class RivalSearch {
 public:
  // host: name of this machine in the deployment; empty: it names none.
  RivalSearch(const std::string& deployment, const std::string& host, std::uint32_t domain);
  // The name that the participant of this run must have.
  std::string participant() const { return participant_name(own_); }

  // Call often. Looks twice per second. Returns why this run has to end: a rival that started
  // earlier. That is decided in the first kStart, in which discovery finds the others: later, a run
  // does not end because two networks were joined. Logs each other rival once.
  std::string find(bus::Bus& bus);
  // What find() has returned; empty: this run may go on.
  const std::string& refusal() const { return refusal_; }

  static constexpr std::chrono::seconds kStart{10};

 private:
  using Clock = std::chrono::steady_clock;
  RunIdentity own_;
  std::uint32_t domain_;
  Clock::time_point started_ = Clock::now(), next_ = started_;
  std::set<std::string> reported_;
  std::string refusal_;
};

}  // namespace fivepipe::launch
