// Starts the processes of a deployment, restarts those that die and ends them all. Knows neither
// DDS nor deployments. fivepipe has its own supervisor because a service manager (systemd,
// supervisord) would have to be installed and configured on each host and does not distinguish a
// node that cannot start from one that died.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "launch/supervise/process.h"
#include "launch/supervise/restart.h"
#include "launch/supervise/watchdog.h"

namespace fivepipe::launch {

struct Program {
  std::string name;               // of the node; unique
  std::vector<std::string> argv;  // argv[0]: path of the program
  std::vector<int> cores;         // pins the process to these; empty: no pinning
  std::filesystem::path log;      // receives all output, also after restarts; empty: none
  bool is_dispensable = false;    // RestartSettings
  // Called at each start of the process: further arguments. Empty: none.
  std::function<std::vector<std::string>()> arguments_at_start = {};
};

struct ProcessRecord {
  pid_t pid = 0;
  std::int64_t start_stamp_ns = 0;  // CLOCK_REALTIME
  std::string end;                  // how it ended; empty while it runs
};
struct ProgramHistory {
  std::string name, program;
  std::vector<ProcessRecord> processes;  // by start; all but the first are restarts
  std::string other_host = {};           // on which the node runs; empty: this host
};

struct Failure {
  std::string node, reason;
  std::vector<std::string> last_lines;  // of its output
  int exit_code = 1;                    // for the deployment
};

// Receives each line that a node prints, and each event, such as a restart.
struct SupervisorOutput {
  std::function<void(const std::string& node, const std::string& line)> line = [](auto&&, auto&&) {
  };
  std::function<void(const std::string& text)> event = [](auto&&) {};
};

// Call its functions from one thread, which must outlive the supervisor (see ChildProcess).
//
// No function waits for the disk of the logs, which may hang: each log has a queue and a thread. A
// full queue drops lines. The constructor creates the logs and does wait for the disk.
class Supervisor {
 public:
  using Clock = std::chrono::steady_clock;
  // A disk that works takes the last lines within milliseconds.
  static constexpr std::chrono::milliseconds kLogTimeout{300};

  // watchdog: nullopt: stalled processes are not noticed.
  Supervisor(const std::vector<Program>& programs, RestartSettings settings,
             SupervisorOutput output,
             std::optional<WatchdogSettings> watchdog = WatchdogSettings{});
  // Kills the processes that still run, and waits at most kKillTimeout for each, and at most
  // kLogTimeout until all logs are written. Then drops the rest of the logs and reports the event.
  ~Supervisor();

  // Call when this process of the node on this machine has handled a frame. Ignores a process that
  // the supervisor has not started.
  void mark_healthy(const std::string& node, pid_t process);

  // Forwards output, handles processes that ended, kills stalled ones, and starts those that are
  // due. Waits at most `wait` for output or a due start. A process that a debugger holds, or that
  // writes a core dump, is not stalled. A process that outlives SIGKILL by kKillTimeout is
  // abandoned and restarted.
  void step(std::chrono::milliseconds wait);

  // Sends SIGTERM to every process. step() kills those that still run after `grace` and lists them
  // in killed(). It abandons a process that outlives SIGKILL by kKillTimeout, so all_exited() holds
  // at most that long after the grace. A later call can only shorten the grace.
  void stop(std::chrono::milliseconds grace);
  bool stopping() const { return stop_deadline_.has_value(); }

  // No process runs or is due to start, except abandoned ones.
  bool all_exited() const;
  bool exited_cleanly(const std::string& node) const;  // with exit code 0, before stop()
  // The first node that cannot start. The supervisor stops the others.
  const std::optional<Failure>& failure() const { return failure_; }
  // Nodes that were killed because they did not end within the grace.
  const std::vector<std::string>& killed() const { return killed_; }
  // Nodes that ended after stop() by a crash or with an unexpected exit code.
  const std::vector<std::string>& crashed_while_stopping() const { return crashed_while_stopping_; }
  std::vector<ProgramHistory> history() const;

 private:
  class LogFile;
  struct Supervised {
    Program program;
    RestartPolicy policy;
    std::unique_ptr<base::Heartbeat> heartbeat;  // of the child
    std::unique_ptr<ChildProcess> child;
    Watchdog watchdog;
    bool handles_frames = false;  // the child
    Clock::time_point started{};
    std::optional<Clock::time_point> start_due, killed;
    bool exited_cleanly = false;
    std::unique_ptr<LogFile> log;
    std::deque<std::string> last_lines;
    std::vector<ProcessRecord> processes;
  };

  void start(Supervised& node);
  void stop_deployment(Supervised& node, const StopDeployment& why);
  void forward_output(Supervised& node, bool flush);
  void handle_exit(Supervised& node, const ProcessExit& exit);
  void poll_outputs(std::chrono::milliseconds wait) const;
  void kill_stalled();
  void restart(Supervised& node, const ProcessExit& exit);  // after its end
  void kill_remaining();
  void abandon(Supervised& node);
  void report_incomplete_log(const Supervised& node) const;

  std::vector<Supervised> nodes_;
  SupervisorOutput output_;
  std::optional<WatchdogSettings> watchdog_;
  Clock::time_point watched_ = Clock::now();
  std::optional<Clock::time_point> stop_deadline_;
  std::optional<Failure> failure_;
  std::vector<std::string> killed_, crashed_while_stopping_;
};

}  // namespace fivepipe::launch
