// Compares this host with the other hosts of its deployment: clocks, versions and files.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/bus/bus.h"
#include "launch/supervise/hosts/host_checks.h"
#include "launch/supervise/hosts/host_state.h"

namespace fivepipe::launch {

// Returns the checksum of each file of the deployment, by its path relative to the folder of the
// deployment file, of which HostStatus has the end if it is long. Leaves out a file that cannot be
// read any more.
Checksums checksums_of(const config::Deployment& deployment);

// The state that a message describes. Uses kMaxListed entries of each list.
HostState state_from(const fivepipe_v1_HostStatus& message);
inline constexpr std::size_t kMaxListed = 256;

class HostExchange {
 public:
  // own: this host, and the program that speaks for it.
  HostExchange(bus::Bus& bus, const config::Deployment& deployment, const HostSpeaker& own);

  // Call at least every 0.1 s: takes and sends messages. Within kStart, compares clocks more often.
  void step();
  // The others that publish, by name, each with its newest state.
  std::vector<ComparedHost> others() const;
  const HostState& own() const { return own_; }
  bool is_starting() const { return Clock::now() - started_ < kStart; }
  static constexpr std::chrono::seconds kStart{10};
  static constexpr std::chrono::milliseconds kStartPeriod{200}, kPeriod{1000};
  // Others that are silent for longer are forgotten, with the comparison of their clock.
  static constexpr std::chrono::seconds kMaxSilence{10};

 private:
  using Clock = std::chrono::steady_clock;
  struct Other {
    HostState state;
    Clock::time_point heard{};                  // its newest message
    std::int64_t sent_ns = 0, received_ns = 0;  // of that message; by its clock and ours
    ClockComparison clock;
  };
  // Returns whether the deployment has such a host, and a program that publishes for it.
  bool is_possible(const HostSpeaker& speaker) const;
  void take();
  void send();

  HostState own_;
  const std::vector<config::Host> hosts_;
  bus::Reader<bus::topics::HostStatus> in_;
  bus::Writer<bus::topics::HostStatus> out_;
  std::map<HostSpeaker, Other> others_;
  std::deque<std::int64_t> sent_ns_;  // of the newest messages: only answers to them count
  bool is_bad_stamp_reported_ = false;
  Clock::time_point started_ = Clock::now(), next_ = started_;
};

// That of `fivepipe up` on the host; nullptr: the deployment has no others, or all of its nodes run
// here (`local`).
std::unique_ptr<HostExchange> exchange_of_up(bus::Bus& bus, const config::Deployment& deployment,
                                             const std::string& host, bool local);

}  // namespace fivepipe::launch
