// When a process announces itself to machines whose processes have all gone. Pure. Internal to bus.
#pragma once
#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace fivepipe::bus::detail {

class Announcements {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kPeriod{200};
  // After this time without a process of the machine, only the usual announcements find one.
  static constexpr std::chrono::seconds kSearch{20};
  // At most this many announcements at once, and one more per second: programs that start and end
  // again and again on the other machine must not keep this process busy.
  static constexpr int kMaxAtOnce = 100;
  // Remembered processes, and missing machines; a peer can invent any number.
  static constexpr std::size_t kMaxRemembered = 1024;

  Announcements(std::string own_machine, Clock::time_point now)
      : own_machine_(std::move(own_machine)), budget_at_(now) {}

  // Discovery has found the process. The network to its machine works.
  void found(const std::string& guid, const std::string& machine);
  // The process has ended, or the network to it fails. Its machine is missing, unless another one
  // of its processes is present.
  void lost(const std::string& guid, Clock::time_point now);
  // Returns true if this process must announce itself now, and counts the announcement. Call it
  // again at next().
  bool take_due(Clock::time_point now);
  // Time of the next announcement, which may be in the past. nullopt: no machine is missing.
  std::optional<Clock::time_point> next() const;

 private:
  bool spend_one(Clock::time_point now);

  const std::string own_machine_;
  std::map<std::string, std::string> present_;        // machines of the processes, by GUID
  std::map<std::string, Clock::time_point> missing_;  // end of the search, by machine
  double budget_ = kMaxAtOnce;                        // of announcements; one more per second
  Clock::time_point budget_at_;                       // time of budget_
  std::optional<Clock::time_point> due_;
};

}  // namespace fivepipe::bus::detail
