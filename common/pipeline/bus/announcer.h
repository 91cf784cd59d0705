// Lets processes that have lost each other find each other again at once. Internal to bus.
#pragma once
#include <dds/dds.h>

#include <chrono>
#include <map>
#include <string>
#include <thread>

#include "common/pipeline/bus/bus.h"

namespace fivepipe::bus::detail {

// When the network to another machine fails for longer than a lease, the processes of both forget
// each other. Cyclone DDS announces a participant once per SPDPInterval (1 s), to 33 ports of each
// machine, so more often would cost too many packets. While a process is missing, the announcer
// does so each kPeriod, by a change of the participant's user data: it appends or removes
// kAnnouncement, which user_data_of() leaves out.
class Announcer {
 public:
  static constexpr std::chrono::milliseconds kPeriod{200};
  // A process that is missing for longer has ended, or is found by the usual announcements.
  static constexpr std::chrono::seconds kSearch{20};
  static constexpr char kAnnouncement = '\n';

  // user_data: of the participant, which must outlive the announcer.
  Announcer(dds_entity_t participant, std::string user_data);
  ~Announcer();
  Announcer(const Announcer&) = delete;
  Announcer& operator=(const Announcer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  // Remembered processes; a peer can invent any number.
  static constexpr std::size_t kMaxRemembered = 1024;

  void run();
  void take_participants();
  void announce();

  const dds_entity_t participant_;
  const std::string user_data_;
  const Entity reader_, ended_, waitset_;
  std::map<std::string, std::string> present_;        // user data, by GUID
  std::map<std::string, Clock::time_point> missing_;  // until when they count, by user data
  bool is_longer_ = false;                            // the user data has kAnnouncement
  std::thread thread_;
};

}  // namespace fivepipe::bus::detail
