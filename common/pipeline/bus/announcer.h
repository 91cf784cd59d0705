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
// machine, so more often would cost too many packets. While all processes of another machine are
// missing, the announcer announces this participant every kPeriod, by a change of its user data: it
// appends or removes kAnnouncement, which user_data_of() removes.
class Announcer {
 public:
  static constexpr std::chrono::milliseconds kPeriod{200};
  // After this time without a process of the machine, only the usual announcements find one.
  static constexpr std::chrono::seconds kSearch{20};
  // At most this many announcements at once, and one more per second: programs that start and end
  // again and again on the other machine must not keep the announcer at work.
  static constexpr double kMaxAnnouncements = 100;
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
  void take_participant(const std::string& guid, const std::string& machine);
  void take_end(const std::string& guid);
  bool may_announce();
  void announce();

  const dds_entity_t participant_;
  const std::string user_data_;
  const Entity reader_, ended_, waitset_;
  std::map<std::string, std::string> present_;        // machines of the processes, by GUID
  std::map<std::string, Clock::time_point> missing_;  // until when they count, by machine
  double announcements_ = kMaxAnnouncements;          // that may follow
  Clock::time_point counted_at_ = Clock::now();       // when they were
  bool is_longer_ = false;                            // the user data has kAnnouncement
  std::thread thread_;
};

}  // namespace fivepipe::bus::detail
