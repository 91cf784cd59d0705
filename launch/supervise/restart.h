// Whether a node that died is started again, and when it is given up. No clock, no process: a pure
// decision.
#pragma once
#include <string>
#include <variant>

#include "launch/supervise/process.h"

namespace fivepipe::launch {

struct RestartSettings {
  double first_delay_s = 0.25;  // doubles with each death in a row
  double max_delay_s = 4.0;
  double healthy_after_s = 10.0;  // a process that lived this long starts the row anew
  double quick_death_s = 2.0;     // dying sooner counts as not starting
  int quick_deaths = 5;           // so many in a row: the node can't start
};

struct Restart {
  double delay_s;
  int number;
};  // number: the how manieth restart of this node
struct GiveUp {
  int exit_code;
  std::string reason;
};                // the deployment's exit code
struct Ended {};  // exit code 0: done, nothing to restart
using RestartDecision = std::variant<Restart, GiveUp, Ended>;

class RestartPolicy {
 public:
  explicit RestartPolicy(RestartSettings settings = {}) : settings_(settings) {}

  // The node has handled a frame: it could start, so that later on missing hardware is worth
  // waiting for.
  void mark_healthy() { is_healthy_ = true; }
  RestartDecision on_exit(const ProcessExit& exit, double uptime_s);

 private:
  RestartSettings settings_;
  bool is_healthy_ = false;
  int restarts_ = 0, deaths_in_row_ = 0, quick_deaths_in_row_ = 0;
};

}  // namespace fivepipe::launch
