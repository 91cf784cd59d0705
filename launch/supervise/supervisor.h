// Starts the processes of a deployment, restarts those that die, ends them all. Knows neither DDS
// nor deployments.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "launch/supervise/process.h"
#include "launch/supervise/restart.h"

namespace fivepipe::launch {

struct Program {
  std::string name;               // the node's; unique
  std::vector<std::string> argv;  // argv[0]: path of the program
  std::vector<int> cores;         // pinned to these; empty: not pinned
  std::filesystem::path log;      // everything it prints, over all its restarts; empty: none
};

struct ProcessRecord {
  pid_t pid = 0;
  std::int64_t start_stamp_ns = 0;  // CLOCK_REALTIME
  std::string end;                  // cause; empty while it runs
};
struct ProgramHistory {
  std::string name, program;
  std::vector<ProcessRecord> processes;  // in the order started; all but the first are restarts
};

struct Failure {
  std::string node, reason;
  std::vector<std::string> last_lines;  // of its output
  int exit_code = 1;                    // for the deployment
};

// Where the supervisor speaks: a node's line of output, and what happened to a node.
struct SupervisorOutput {
  std::function<void(const std::string& node, const std::string& line)> line = [](auto&&, auto&&) {
  };
  std::function<void(const std::string& text)> event = [](auto&&) {};
};

// One thread, which must outlive the supervisor (see ChildProcess). The destructor kills what still
// runs.
class Supervisor {
 public:
  using Clock = std::chrono::steady_clock;

  Supervisor(const std::vector<Program>& programs, RestartSettings settings,
             SupervisorOutput output);

  // The node's process that started at this time [ns, CLOCK_REALTIME] has handled a frame.
  void mark_healthy(const std::string& node, std::int64_t process_start_stamp_ns);

  // Passes on output, notices deaths, starts what is due; waits at most this long for something to
  // happen.
  void step(std::chrono::milliseconds wait);

  // SIGTERM to every process; what is left after `grace` is killed and named. Goes on in step(). A
  // second call can only shorten.
  void stop(std::chrono::milliseconds grace);
  bool stopping() const { return stop_deadline_.has_value(); }

  bool all_exited() const;                             // no process runs and none will be started
  bool exited_cleanly(const std::string& node) const;  // ended by itself with exit code 0
  const std::optional<Failure>& failure() const {
    return failure_;
  }  // a node that can't start; the rest is being stopped
  const std::vector<std::string>& killed() const {
    return killed_;
  }  // those that outlived the grace
  const std::vector<std::string>& crashed_while_stopping() const {
    return crashed_while_stopping_;
  }  // died while being stopped, by crash or exit code
  std::vector<ProgramHistory> history() const;

 private:
  struct Supervised {
    Program program;
    RestartPolicy policy;
    std::unique_ptr<ChildProcess> child;
    Clock::time_point started{};
    std::optional<Clock::time_point> start_due;
    bool exited_cleanly = false;
    std::ofstream log;
    std::deque<std::string> last_lines;
    std::vector<ProcessRecord> processes;
  };

  void start(Supervised& node);
  void give_up(Supervised& node, const GiveUp& why);
  void forward_output(Supervised& node, bool flush);
  void handle_exit(Supervised& node, const ProcessExit& exit);
  void poll_outputs(std::chrono::milliseconds wait) const;
  void kill_remaining();

  std::vector<Supervised> nodes_;
  SupervisorOutput output_;
  std::optional<Clock::time_point> stop_deadline_;
  std::optional<Failure> failure_;
  std::vector<std::string> killed_, crashed_while_stopping_;
};

}  // namespace fivepipe::launch
