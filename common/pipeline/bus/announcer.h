// Lets processes that have lost each other find each other again at once. Internal to bus.
#pragma once
#include <dds/dds.h>

#include <string>
#include <thread>

#include "common/pipeline/bus/announce/announcements.h"
#include "common/pipeline/bus/bus.h"

namespace fivepipe::bus::detail {

// When the network to another machine fails for longer than a lease, the processes of both forget
// each other. Cyclone DDS announces a participant once per SPDPInterval (1 s), to 33 ports of each
// machine, so more often would cost too many packets. While all processes of another machine are
// missing, the announcer announces this participant more often (Announcements), by a change of its
// user data: it appends or removes kAnnouncement, which user_data_of() removes.
class Announcer {
 public:
  static constexpr char kAnnouncement = '\n';

  // user_data: of the participant, which must outlive the announcer.
  Announcer(dds_entity_t participant, std::string user_data);
  ~Announcer();
  Announcer(const Announcer&) = delete;
  Announcer& operator=(const Announcer&) = delete;

 private:
  void run();
  void take_participants();
  void announce();

  const dds_entity_t participant_;
  const std::string user_data_;
  const Entity reader_, ended_, waitset_;
  Announcements announcements_;
  bool is_longer_ = false;  // the user data has kAnnouncement
  std::thread thread_;
};

}  // namespace fivepipe::bus::detail
