// Starts a child process, reads its output and ends it. Linux only.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "common/base/process/heartbeat.h"

namespace fivepipe::launch {

struct ProcessExit {
  bool by_signal = false;
  int number = 0;  // the signal, or the exit code
};
// "killed by signal 9 (SIGKILL)", "exit code 3 (hardware or peer missing)".
std::string to_string(const ProcessExit& exit);

// A process ends within milliseconds of SIGKILL, except one that the kernel cannot interrupt
// because it waits for a disk or a driver.
inline constexpr std::chrono::milliseconds kKillTimeout{300};

// A process in its own process group, so that the processes that it starts end with it. Its stdin
// is /dev/null; stdout and stderr are one pipe, in the order written. The kernel kills the process
// when the thread that started it ends (PR_SET_PDEATHSIG): start children from the main thread
// only. The destructor kills the group, and reaps the process if it ends within kKillTimeout.
class ChildProcess {
 public:
  // argv[0] is the path of the program. Pins the process to `cores` unless that is empty. Throws
  // std::system_error if the program cannot be executed. The constructor passes the memory of
  // `heartbeat` to the process; nullptr: the process has none.
  ChildProcess(const std::vector<std::string>& argv, const std::vector<int>& cores,
               const base::Heartbeat* heartbeat = nullptr);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  int output_fd() const { return output_fd_; }  // for poll(); -1 once it is closed

  // Returns the complete lines since the last call, without newlines. With `flush`, also an
  // incomplete last line. Never blocks.
  std::vector<std::string> read_lines(bool flush = false);
  // Returns how the process ended; nullopt while it runs. Never blocks.
  std::optional<ProcessExit> ended();
  // Returns whether the process has ended, after at most `timeout`.
  bool wait_for_end(std::chrono::milliseconds timeout);
  // The destructor does not wait. Call it for a process that has outlived kKillTimeout.
  void abandon() { abandoned_ = true; }
  void signal_group(int signal) const;
  // Returns whether a debugger holds the process, or the kernel while it writes a core dump.
  bool is_held() const;

 private:
  pid_t pid_ = -1;
  int output_fd_ = -1;
  std::string unfinished_;
  std::optional<ProcessExit> exit_;
  bool abandoned_ = false;
};

}  // namespace fivepipe::launch
