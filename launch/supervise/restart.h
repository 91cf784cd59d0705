// Decides whether the supervisor restarts a node whose process ended, and after which delay. Pure:
// knows no clock and no process.
#pragma once
#include <string>
#include <variant>

#include "launch/supervise/process.h"

namespace fivepipe::launch {

struct RestartSettings {
  double first_delay_s = 0.25;  // doubles with each consecutive death; none after healthy_after_s
  double max_delay_s = 4.0;
  double healthy_after_s = 10.0;  // an uptime from which earlier deaths no longer count
  double quick_death_s = 2.0;     // an uptime below this counts as a failed start
  int quick_deaths = 5;           // consecutive failed starts after which the node cannot start
  // The node never stops the deployment: a failed start is tried again, after at most max_delay_s.
  bool is_dispensable = false;
};

struct Restart {
  double delay_s;
  int number;  // of this node's restarts, from 1
};
struct StopDeployment {
  int exit_code;  // of the deployment
  std::string reason;
};
struct Ended {};  // the process exited with code 0: no restart
using RestartDecision = std::variant<Restart, StopDeployment, Ended>;

class RestartPolicy {
 public:
  explicit RestartPolicy(RestartSettings settings = {}) : settings_(settings) {}

  // Call when the node has handled a frame. From then on the policy waits for missing hardware
  // instead of returning StopDeployment, because a camera may have been unplugged.
  void mark_healthy() { is_healthy_ = true; }
  RestartDecision on_exit(const ProcessExit& exit, double uptime_s);

 private:
  RestartSettings settings_;
  bool is_healthy_ = false;
  int restarts_ = 0, deaths_in_row_ = 0, quick_deaths_in_row_ = 0;
};

}  // namespace fivepipe::launch
